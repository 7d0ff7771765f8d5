#!/bin/bash
# GeoPackage layers that ogr2ogr of Debian 12 (gdal-bin 3.6.2+dfsg-1+b2) writes: a plain sqlite3 (3.40.1-2+deb12u2) cannot
# change an attribute of a feature, though the attribute has nothing to do with the geometry. The triggers of the
# spatial index fire on every UPDATE of the row, and SQLite compiles ST_IsEmpty into them, a function that GDAL and QGIS
# register and sqlite3 does not have: "no such function: ST_IsEmpty". Reading works, and so does the same UPDATE on a
# layer that was written without a spatial index.
# Seen: valid layers of one point, the same UPDATE on both, error on the first; fails where that changes.
# Needs the libraries that libgdal32 depends on, as gdal-bin brings them.
set -euo pipefail
readonly gdal=3.6.2+dfsg-1+b2
readonly sqlite=3.40.1-2+deb12u2
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
chmod 755 "$folder"
cd "$folder"

apt-get download "gdal-bin=$gdal" "libgdal32=$gdal" "sqlite3=$sqlite" > /dev/null 2>&1
for package in ./*.deb; do dpkg -x "$package" root; done
libraries="$(dirname "$(find root -name 'libgdal.so.32' | head -n 1)")"
export LD_LIBRARY_PATH="$folder/$libraries"
export PATH="$folder/root/usr/bin:$PATH"

printf 'x,y,species\n401234.5,5654321.0,oak\n' > stems.csv
make() {
  ogr2ogr -f GPKG "$1.gpkg" stems.csv -nln stems -a_srs EPSG:25832 -lco "SPATIAL_INDEX=$2" \
    -oo X_POSSIBLE_NAMES=x -oo Y_POSSIBLE_NAMES=y
}
make indexed YES
make plain NO

readonly update="UPDATE stems SET species = 'beech'"
[ "$(sqlite3 indexed.gpkg 'SELECT species FROM stems')" = oak ]
if said="$(sqlite3 indexed.gpkg "$update" 2>&1)"; then
  echo "changed: a plain sqlite3 changes an attribute of an indexed layer"
  exit 1
fi
case "$said" in
  *"no such function: ST_IsEmpty"*) ;;
  *) echo "changed: $said"; exit 1 ;;
esac
sqlite3 plain.gpkg "$update"
[ "$(sqlite3 plain.gpkg 'SELECT species FROM stems')" = beech ]
echo "as described: $(ogr2ogr --version | cut -d, -f1), sqlite3 $(sqlite3 --version | cut -d' ' -f1): $said"
