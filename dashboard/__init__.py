"""The dashboard: listens to a fleet, folds what it hears into progress, draws it. It commands nothing."""
