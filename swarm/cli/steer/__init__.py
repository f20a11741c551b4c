"""Commands to a running fleet and its robots: buttons, edits, orders, and what the wire says of an order."""
