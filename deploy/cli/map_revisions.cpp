#include "deploy/cli/map_revisions.hpp"

#include <cstdlib>
#include <stdexcept>

namespace understory::cli {
namespace {

namespace fs = std::filesystem;
using map_file::Access;
using map_file::MapFile;

fs::path new_folder() {
  std::string name = (fs::temp_directory_path() / "understory-view-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error(name + ": cannot be made");
  return name;
}

}  // namespace

MapRevisions::MapRevisions(fs::path file)
    : file_(std::move(file)),
      changes_(MapFile(file_, Access::kRead).history()),
      folder_(new_folder()) {}

MapRevisions::~MapRevisions() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

std::vector<map_file::StoredMap> MapRevisions::after(std::uint64_t number) const {
  const fs::path copy = folder_ / "map.gpkg";
  fs::copy_file(file_, copy, fs::copy_options::overwrite_existing);
  MapFile file(copy, Access::kWrite);
  if (number < changes_.size())
    file.revert(number, {0, "understory view", file_.string(), "to be looked at"});

  std::vector<map_file::StoredMap> maps;
  for (const map_file::MapSummary& summary : file.maps()) maps.push_back(file.read(summary.map_id));
  return maps;
}

void show(const std::vector<map_file::StoredMap>& maps, viewer::Scene& scene) {
  scene.reset();
  for (const map_file::StoredMap& map : maps) {
    std::vector<model::MapLandmark> landmarks;
    std::vector<model::LandmarkExistence> existence;
    landmarks.reserve(map.landmarks.size());
    for (const map_file::StoredLandmark& one : map.landmarks) {
      landmarks.push_back(one.landmark);
      if (one.existence)
        existence.push_back({.id = one.landmark.id, .probability = *one.existence});
    }
    if (map.existence) {
      for (const map_file::ExistenceRow& row : map.existence->landmarks)
        existence.push_back(row.existence);
    }
    scene.take_stored(landmarks, existence, map.keyframes);
  }
}

}  // namespace understory::cli
