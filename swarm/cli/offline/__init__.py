"""Commands that need no running fleet: paths, rules, recorded runs, schemas, storms, drills and benchmarks."""
