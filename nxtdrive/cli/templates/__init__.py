"""The files that `nxtdrive mission new` and `nxtdrive world new` write."""
