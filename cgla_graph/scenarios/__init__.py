"""Problems and missions in files: TOML, GeoJSON, grid maps, random maps, and those that are shipped."""
