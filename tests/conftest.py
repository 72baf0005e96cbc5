"""The suite uses the plugin that other people's suites use, also where its entry point is not installed."""

pytest_plugins = ["nxtdrive.pytest_plugin", "pytester"]
