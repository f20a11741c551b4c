"""The profiles that come with the project, one YAML file each; `load_profile` knows them by their file names."""
