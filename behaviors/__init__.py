"""The mission's behaviour: skills, statechart, recoveries and profiles; knows robot and camera only as ports."""
