"""Makes the package's types: generate.py LCM_GEN FOLDER TYPE.lcm ...

lcm-gen initialises arrays of bytes with the text "", which its own encoder refuses: a message with
an empty field of this kind could not be sent. They become b"".
"""

import pathlib
import re
import subprocess
import sys


def mended(code):
    """The code of a type with empty bytes instead of empty text."""
    for name in set(re.findall(r"bytearray\(self\.(\w+)\[", code)):
        code = re.sub(rf'(self\.{name} = )""', r'\1b""', code)
    return code


def main():
    lcm_gen, folder, *types = sys.argv[1:]
    subprocess.run([lcm_gen, "--python", "--ppath", folder, *types], check=True)
    for file in pathlib.Path(folder, "understory").glob("*_t.py"):
        file.write_text(mended(file.read_text()))


if __name__ == "__main__":
    main()
