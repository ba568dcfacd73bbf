"""The panel: the settings, maps and flights that statements about flights are tested on."""
