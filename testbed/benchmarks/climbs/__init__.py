"""Long climbs and quiet stands."""
