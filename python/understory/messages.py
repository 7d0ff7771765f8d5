"""Decoding of messages of understory's types: selects the class for some bytes.

The types themselves are made by lcm-gen and are in this package: `understory.slam_pose2_t` and so on.
"""

import understory

_FINGERPRINT_BYTES = 8


def _types():
    found = {}
    for name in dir(understory):
        one = getattr(understory, name)
        if name.endswith("_t") and hasattr(one, "_get_packed_fingerprint"):
            found[one._get_packed_fingerprint()] = one
    return found


_BY_FINGERPRINT = _types()


def decode(data):
    """The message in these bytes, by the fingerprint at their start; None if no type of understory has
    it. Raises ValueError if the type is known and the bytes are damaged."""
    message_type = _BY_FINGERPRINT.get(bytes(data[:_FINGERPRINT_BYTES]))
    if message_type is None:
        return None
    try:
        return message_type.decode(bytes(data))
    except Exception as error:  # lcm-gen's decoders raise all errors of struct and UTF-8
        raise ValueError(f"damaged {message_type.__name__}: {error}") from error
