"""Who is to drive where: missions, orders, the pool, places. Imports `measure` and `bodies`."""
