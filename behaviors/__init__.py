"""The mission's behaviour: skills, statechart, recoveries and profiles; reaches robot and camera only through ports."""
