"""``python -m nxtdrive`` is ``nxtdrive``, where scripts are not on the path."""

from nxtdrive.cli.main import main

if __name__ == "__main__":
    raise SystemExit(main())
