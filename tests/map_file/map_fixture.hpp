// Random maps, and what is in a file seen without the code under test.
#pragma once

#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "common/map_file/geometry_functions.hpp"
#include "common/map_file/map_file.hpp"
#include "common/map_file/schema.hpp"
#include "tests/catch.hpp"
#include "tests/io/log_fixture.hpp"

namespace understory::test {

using map_file::Access;
using map_file::ChangeNote;
using map_file::Fault;
using map_file::MapFile;
using map_file::MapFileError;
using map_file::StoredMap;

template <int N>
Eigen::Matrix<double, N, N> random_covariance(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, N, N> root;
  for (int i = 0; i < N * N; ++i) root(i) = 0.1 * normal(random);
  const Eigen::Matrix<double, N, N> square = root * root.transpose();
  return 0.5 * (square + square.transpose());
}

inline Eigen::Vector2d random_place(std::mt19937_64& random) {
  std::uniform_real_distribution<double> side(-5e3, 5e3);
  const double x = side(random);
  return {x, side(random)};
}

inline map_file::StoredLandmark random_landmark(model::LandmarkId id, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  map_file::StoredLandmark one;
  one.landmark.id = id;
  one.landmark.position_m = random_place(random);
  if (unit(random) < 0.8) one.landmark.covariance_m2 = random_covariance<2>(random);
  if (unit(random) < 0.8) one.landmark.radius_m = unit(random);
  one.landmark.observation_count = static_cast<std::uint32_t>(random() & 0xFFFFFFFFU);
  if (unit(random) < 0.3) one.landmark.kind = model::LandmarkKind::kCorner;
  if (unit(random) < 0.5) one.submap_id = random() >> 1U;
  if (unit(random) < 0.5) one.existence = unit(random);
  return one;
}

/// States of some of its landmarks; the tracker's bytes, zeros among them.
inline void give_random_existence(StoredMap& map, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto bytes = [&] {
    std::string text;
    for (std::size_t i = 1 + random() % 12; i > 0; --i)
      text += static_cast<char>(random() % 5 == 0 ? 0U : random() & 0xFFU);
    return text;
  };
  map_file::StoredExistence existence{static_cast<model::Utime>(random() >> 2U), bytes(), {}};
  for (const map_file::StoredLandmark& one : map.landmarks) {
    if (unit(random) < 0.3) continue;
    existence.landmarks.push_back({{one.landmark.id, unit(random), random() % 3 != 0},
                                   static_cast<model::Utime>(random() >> 2U),
                                   bytes()});
  }
  map_file::give_existence(map, existence);
}

inline StoredMap random_map(std::uint32_t map_id, std::mt19937_64& random,
                            std::size_t most_landmarks = 60) {
  const auto count = [&](std::size_t most) {
    return static_cast<std::size_t>(random() % (most + 1));
  };
  std::uniform_real_distribution<double> angle(-3.2, 3.2);
  StoredMap map;
  map.map_id = map_id;
  map.name = fmt::format("W\xC3\xA4ldchen '{}'", random() % 100);
  map.created_utime = static_cast<model::Utime>(random() % 2'000'000'000'000'000);
  map.origin = "drive.lcm";

  std::uint64_t counter = 0;
  for (std::size_t i = count(most_landmarks); i > 0; --i)
    map.landmarks.push_back(
        random_landmark(map_file::landmark_id(map_id, counter += 1 + count(3)), random));
  for (std::size_t i = count(most_landmarks / 2); i > 0; --i) {
    map.keyframes.push_back({random() >> 1U, static_cast<model::Utime>(random() >> 2U),
                             geometry::SE2(random_place(random), angle(random)),
                             random_covariance<3>(random)});
  }
  for (std::size_t i = count(3); i > 0; --i) {
    map_file::SubmapBorder border{random() >> 1U, {}};
    for (std::size_t k = 3 + count(4); k > 0; --k) border.corners_m.push_back(random_place(random));
    map.submap_borders.push_back(border);
  }
  for (std::size_t i = count(3); i > 0; --i)
    map.loop_closures.push_back(
        {random() >> 1U, random() >> 1U, random_place(random), random_place(random)});
  if (count(3) > 0) give_random_existence(map, random);
  return map;
}

inline bool same(const map_file::StoredLandmark& a, const map_file::StoredLandmark& b) {
  return a.landmark.id == b.landmark.id && a.landmark.position_m == b.landmark.position_m &&
         a.landmark.covariance_m2 == b.landmark.covariance_m2 &&
         a.landmark.radius_m == b.landmark.radius_m &&
         a.landmark.observation_count == b.landmark.observation_count &&
         a.landmark.kind == b.landmark.kind && a.submap_id == b.submap_id &&
         a.existence == b.existence;
}

inline bool same(const model::KeyframePose& a, const model::KeyframePose& b) {
  return a.keyframe_sequence == b.keyframe_sequence && a.utime == b.utime &&
         a.map_T_vehicle.coordinates() == b.map_T_vehicle.coordinates() &&
         a.covariance == b.covariance;
}

inline bool same(const map_file::SubmapBorder& a, const map_file::SubmapBorder& b) {
  return a.submap_id == b.submap_id && a.corners_m == b.corners_m;
}

inline bool same(const map_file::LoopClosure& a, const map_file::LoopClosure& b) {
  return a.from_sequence == b.from_sequence && a.to_sequence == b.to_sequence &&
         a.from_m == b.from_m && a.to_m == b.to_m;
}

/// Equal to the bit.
inline bool same(const StoredMap& a, const StoredMap& b) {
  const auto all = [](const auto& x, const auto& y) {
    return std::equal(x.begin(), x.end(), y.begin(), y.end(),
                      [](const auto& p, const auto& q) { return same(p, q); });
  };
  return a.map_id == b.map_id && a.name == b.name && a.created_utime == b.created_utime &&
         a.origin == b.origin && all(a.landmarks, b.landmarks) && all(a.keyframes, b.keyframes) &&
         all(a.submap_borders, b.submap_borders) && all(a.loop_closures, b.loop_closures) &&
         a.existence == b.existence;
}

inline ChangeNote note(const std::string& text) {
  return {1'700'000'000'000'000, "test", "nowhere", text};
}

/// A file as any other program sees it; errors end the test.
class RawFile {
 public:
  explicit RawFile(const std::filesystem::path& path) {
    REQUIRE(sqlite3_open(path.c_str(), &handle_) == SQLITE_OK);
    // As GDAL does: the layers' triggers call them.
    map_file::register_geometry_functions(handle_);
  }
  ~RawFile() { sqlite3_close(handle_); }
  RawFile(const RawFile&) = delete;
  RawFile& operator=(const RawFile&) = delete;

  /// All rows, a line each, values as SQL literals.
  std::string rows(const std::string& sql) const {
    std::string text;
    const auto add = [](void* out, int count, char** values, char** /*names*/) {
      for (int i = 0; i < count; ++i)
        static_cast<std::string*>(out)->append(values[i] == nullptr ? "NULL" : values[i]) += '|';
      static_cast<std::string*>(out)->push_back('\n');
      return 0;
    };
    INFO(sql);
    REQUIRE(sqlite3_exec(handle_, sql.c_str(), add, &text, nullptr) == SQLITE_OK);
    return text;
  }
  void run(const std::string& sql) const { rows(sql); }

 private:
  sqlite3* handle_ = nullptr;
};

/// Every value of these tables, exactly.
inline std::string dump_of(const std::filesystem::path& path,
                           const std::vector<const char*>& tables) {
  const RawFile file(path);
  std::string text;
  for (const char* const table : tables) {
    const std::string columns = file.rows(fmt::format(
        "SELECT group_concat('quote(' || name || ')', ', ') FROM pragma_table_info('{}')", table));
    text += fmt::format("{}\n", table) +
            file.rows(fmt::format("SELECT {} FROM {} ORDER BY 1",
                                  columns.substr(0, columns.find('|')), table));
  }
  return text;
}

/// All that maps consist of.
inline std::string dump_of_maps(const std::filesystem::path& path) {
  return dump_of(path,
                 {"understory_maps", "landmarks", "trajectory", "submap_borders", "loop_closures",
                  "existence_states", "existence_models", "understory_reference"});
}

/// The same with the indexes.
inline std::string dump(const std::filesystem::path& path) {
  return dump_of_maps(path) +
         dump_of(path, {"rtree_landmarks_geom", "rtree_trajectory_geom",
                        "rtree_submap_borders_geom", "rtree_loop_closures_geom"});
}

/// Makes a file what a program of an earlier version would have written: its maps have no states,
/// and lie nowhere on the earth.
inline void make_older(const std::filesystem::path& path, int version) {
  const RawFile file(path);
  for (const map_file::SchemaObject& one : map_file::schema_objects(version)) {
    if (one.sql.starts_with("CREATE TRIGGER"))
      file.run(fmt::format("DROP TRIGGER {}; {}", one.name, one.sql));
  }
  file.run(
      "DROP TABLE understory_reference; DELETE FROM gpkg_extensions WHERE definition LIKE "
      "'%/168-%'");
  if (version < 3)
    file.run(
        "DROP TABLE existence_states; DROP TABLE existence_models; "
        "DELETE FROM gpkg_extensions WHERE definition LIKE '%/111-%'");
  if (version < 2)
    file.run(
        "DROP TABLE understory_submaps; DROP TABLE understory_submap_poses; "
        "DROP TABLE understory_closures; "
        "DELETE FROM gpkg_extensions WHERE definition LIKE '%/092-%'");
  file.run(
      fmt::format("UPDATE understory_meta SET value = '{}' WHERE key = 'schema_version'", version));
}

/// The fault that `work` ends with, whose line names the file.
template <class Work>
Fault fault_of_work(const std::filesystem::path& file, const Work& work) {
  try {
    work();
  } catch (const MapFileError& error) {
    const std::string line = error.what();
    CAPTURE(line);
    CHECK(line.find(file.filename().string() + ":") != std::string::npos);
    CHECK(line.find('\n') == std::string::npos);
    return error.fault();
  }
  FAIL("nothing was thrown");
  return Fault::kUnreadable;
}

inline Fault fault_of_opening(const std::filesystem::path& file, Access access) {
  return fault_of_work(file, [&] { MapFile opened(file, access); });
}

/// What a child process returns; -1 where it was killed.
inline int in_child(const std::function<int()>& work) {
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    int status = 255;
    try {
      status = work();
    } catch (...) {
    }
    ::_exit(status);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// The fault of opening in another process; -2 = none.
inline int fault_elsewhere(const std::filesystem::path& file, Access access) {
  constexpr int kNone = 100;
  const int status = in_child([&] {
    try {
      const MapFile opened(file, access);
      return kNone;
    } catch (const MapFileError& error) {
      return static_cast<int>(error.fault());
    }
  });
  return status == kNone ? -2 : status;
}

}  // namespace understory::test
