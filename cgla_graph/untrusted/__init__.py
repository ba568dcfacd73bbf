"""Files of strangers, read in bounded time and memory: text, JSON, XML, KML and archives of it."""
