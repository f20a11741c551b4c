"""The names of a fleet's members, and of the files in the folder of each."""

from typing import Final

ROUTER: Final = "router"
WORLD: Final = "world"
OPERATOR: Final = "operator"  # gives orders: go, pause, edit, ...
WATCHER: Final = "watcher"  # sees everything and changes nothing: the dashboard, the launcher, `swarm status`
BRIDGE: Final = "bridge"  # to ROS 2 and others: it gives orders to robots, and shows what the fleet says
ROLES: Final = (ROUTER, WORLD, OPERATOR, WATCHER, BRIDGE)

AUTHORITY: Final = "ca.pem"
CERTIFICATE: Final = "certificate.pem"
KEY: Final = "key.pem"
ACCESS: Final = "access.json"  # the router's only
