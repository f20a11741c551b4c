"""The black box: a run that was recorded is run again, judged, and asked why something happened."""
