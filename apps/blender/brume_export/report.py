"""What an export could not take over, said once each."""

import sys


class ExportError(Exception):
    """The scene can't be exported at all."""


class Report:
    """Warnings: what differs from what Blender shows. Notes: what was done, where nothing is lost that matters."""

    def __init__(self, stream=None):
        self.warnings, self.notes = [], []
        self._stream = stream if stream is not None else sys.stderr

    def warn(self, what, problem, instead):
        """`what` names the object or node, `instead` what the exported scene has in its place."""
        line = "%s: %s; %s" % (what, problem, instead)
        if line not in self.warnings:
            self.warnings.append(line)
            print("warning: " + line, file=self._stream, flush=True)

    def note(self, line):
        if line not in self.notes:
            self.notes.append(line)
