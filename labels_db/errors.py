"""What can go wrong in the record; the server turns these into status codes, the trainer into an end."""


class RecordError(Exception):
    """Something asked of the record cannot be done; the message names it and the way out."""


class NotFoundError(RecordError):
    """No such row; `field` says by which of the things named it was looked for, such as `lease_id`."""

    def __init__(self, reason: str, *, field: str) -> None:
        super().__init__(reason)
        self.field = field


class ChoiceError(RecordError):
    """What was chosen is not among what there is to choose from; the message names that."""


class ConflictError(RecordError):
    """The row's present state does not allow it."""


class AttemptLostError(RecordError):
    """Another attempt owns the run now: this one must not write any more."""


class NewerDatabaseError(RecordError):
    """The database was made by a newer version of the program."""
