"""The dashboard: it listens to a fleet, folds messages into progress and draws it. It commands nothing."""
