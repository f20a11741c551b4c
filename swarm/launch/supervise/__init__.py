"""The processes of a fleet: the table of what each one runs, their fork server, and who starts them again."""
