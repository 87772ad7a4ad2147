"""The tests of ntagen; README.md says how to run, add and bless them."""
