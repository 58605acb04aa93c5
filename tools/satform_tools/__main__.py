# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Starts the command line; `tools/satform` runs this in the right environment."""

import gc
import sys

# Nearly all that imports make stays; looking for garbage in it as often as usual takes a fifth of their time.
gc.set_threshold(50_000)

try:
    from satform_tools import output_streams
    from satform_tools.run import resource_limits

    # Before anything is opened.
    output_streams.prepare()
    too_low = resource_limits.complaint()
    if too_low:
        sys.stderr.write(f"satform: {too_low}\n")
        sys.exit(2)
    from satform_tools import stored_output

    def main() -> int:
        """Run the command line, which imports all commands."""
        from satform_tools.cli.main import main as command_line  # noqa: PLC0415 - slow to import

        return command_line()

    sys.exit(stored_output.run(sys.argv[1:], main))
except KeyboardInterrupt:
    # Before a command has its own way to end.
    sys.exit(130)
except (ImportError, MemoryError, OSError, RuntimeError) as error:
    # The program itself cannot be loaded, as where memory is limited.
    from satform_tools.errors import error_sentences

    sentences = error_sentences(error)
    if not sentences:
        raise
    sys.stderr.writelines(f"satform: {sentence}\n" for sentence in sentences)
    sys.exit(2)
