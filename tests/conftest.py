"""Options of the whole suite."""


def pytest_addoption(parser):
    parser.addoption("--nxt", metavar="ADDRESS", help="run the transport contract on this real brick, e.g. usb://")
