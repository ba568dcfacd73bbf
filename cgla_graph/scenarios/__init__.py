"""Problems and missions in files: TOML, GeoJSON, grid maps, random maps and shipped examples."""
