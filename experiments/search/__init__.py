"""The search for wrong values: random scenes with every tie that integers make, their twins, and referees."""
