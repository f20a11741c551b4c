"""A fleet as vehicles of VDA 5050, version 2.1: each robot has a connection of its own to a broker of MQTT."""
