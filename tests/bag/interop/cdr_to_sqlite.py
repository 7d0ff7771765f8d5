#!/usr/bin/python3
"""CDR messages as a ROS 2 bag: cdr_to_sqlite.py CDR FOLDER: the tables of rosbag2_storage_sqlite3 (Humble), in two files."""
import json
import pathlib
import sqlite3
import sys

TABLES = """CREATE TABLE schema(schema_version INTEGER PRIMARY KEY,ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY,metadata_version INTEGER NOT NULL,metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
INSERT INTO schema VALUES(3,'humble');"""
SPLIT_NS = 25_000_000_000


def main():
    source, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(exist_ok=True)
    files = []
    for number in range(2):
        path = folder / f"{folder.name}_{number}.db3"
        path.unlink(missing_ok=True)
        files.append((sqlite3.connect(path), {}))
        files[-1][0].executescript(TABLES)
    with open(source, "rb") as messages:
        while line := messages.readline():
            head = json.loads(line)
            database, ids = files[int(head["t"]) >= SPLIT_NS]
            if head["topic"] not in ids:
                ids[head["topic"]] = len(ids) + 1
                database.execute("INSERT INTO topics VALUES(?,?,?,'cdr','')", (ids[head["topic"]], head["topic"], head["type"]))
            database.execute("INSERT INTO messages(topic_id,timestamp,data) VALUES(?,?,?)",
                             (ids[head["topic"]], int(head["t"]), messages.read(head["n"])))
    for database, _ in files:
        database.commit()
        database.close()


if __name__ == "__main__":
    main()
