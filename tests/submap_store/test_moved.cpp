// Landmarks of the ground that move again and again.
#include <algorithm>
#include <map>
#include <random>

#include "services/submap_store/submap_store.hpp"
#include "tests/map_file/map_fixture.hpp"
#include "tests/submap_store/store_fixture.hpp"

using namespace understory;
using namespace understory::test;

namespace {

model::MapUpdate keyframe_at(std::uint64_t second,
                             model::MapUpdateStatus status = model::MapUpdateStatus::kUpdated) {
  model::MapUpdate one;
  one.keyframe_sequence = second;
  one.utime = static_cast<model::Utime>(1'000'000 * second);
  one.map_id = 1;
  one.status = status;
  one.covariance = 1e-4 * Eigen::Matrix3d::Identity();
  return one;
}

model::MapLandmark stem_at(std::uint64_t counter, double x_m) {
  model::MapLandmark one;
  one.id = map_file::landmark_id(1, counter);
  one.position_m = {x_m, 1.0};
  one.covariance_m2 = 1e-4 * Eigen::Matrix2d::Identity();
  one.observation_count = 3;
  return one;
}

/// A mapper's landmarks and the file's, as MAP_DELTA and the store tell them.
class MovingGround {
 public:
  std::map<model::LandmarkId, double> held;     ///< x [m] by the mapper.
  std::map<model::LandmarkId, double> written;  ///< In the file.
  submap_store::SubmapStore store;

  /// Some come, some go, some move.
  void change(int round) {
    model::MapDelta delta;
    delta.utime = 1'000'000 * (round + 1);
    delta.base_version = version_;
    delta.version = ++version_;
    for (std::uint64_t n = random_() % 3 + 1; n > 0; --n)
      delta.added.push_back(stem_at(next_++, 0.01 * static_cast<double>(round)));
    for (const auto& [id, x_m] : held) {
      const auto what = random_() % 10;
      if (what == 0) delta.removed.push_back(id);
      if (what > 6) delta.moved.push_back(stem_at(id & 0xffffffff, x_m + 0.1));
    }

    for (const model::MapLandmark& one : delta.added) held[one.id] = one.position_m.x();
    for (const model::MapLandmark& one : delta.moved) held[one.id] = one.position_m.x();
    for (const model::LandmarkId id : delta.removed) held.erase(id);
    store.take(delta);
  }

  /// Returns how many that the file had already were written.
  std::size_t write(std::size_t most) {
    store.draw_moved(most);
    std::size_t moved = 0;
    for (const map_file::GroundChange& change : store.due().ground) {
      for (const model::MapLandmark& one : change.landmarks) {
        moved += written.contains(one.id) ? 1 : 0;
        written[one.id] = one.position_m.x();
      }
      for (const model::LandmarkId id : change.gone) written.erase(id);
    }
    store.written();
    return moved;
  }

  bool has_written_all_ids() const {
    return std::ranges::equal(
        held, written, {}, [](const auto& one) { return one.first; },
        [](const auto& one) { return one.first; });
  }

 private:
  std::mt19937_64 random_{5};
  std::uint64_t version_ = 0;
  std::uint64_t next_ = 1;
};

}  // namespace

TEST_CASE("landmarks that move are written each in its turn, new ones at once", "[submap_store]") {
  constexpr std::size_t kMost = 7;
  MovingGround ground;
  for (int round = 0; round < 200; ++round) {
    if (round % 10 == 9) ground.store.load(ground.store.save());
    ground.change(round);
    REQUIRE(ground.write(kMost) <= kMost);
    REQUIRE(ground.has_written_all_ids());
  }
  REQUIRE(ground.written != ground.held);

  // Nothing waits longer than it takes to write all.
  for (std::size_t rounds = ground.held.size() / kMost + 1; rounds > 0; --rounds)
    (void)ground.write(kMost);
  CHECK(ground.written == ground.held);
  CHECK(ground.store.due().empty());
}

TEST_CASE("what has moved is in the file at the end", "[submap_store]") {
  const TemporaryDirectory directory;
  StoreOnBus store(directory.path(), "[writing]\nmoved_landmarks_per_s = 1\n");
  store.send("SLAM_UPDATE", keyframe_at(1, model::MapUpdateStatus::kFirstMap));
  model::MapDelta delta{1'000'000, 0, 0, 1, {}, {}, {}, {}};
  for (std::uint64_t i = 1; i <= 100; ++i) delta.added.push_back(stem_at(i, 1.0));
  store.send("MAP_DELTA", delta);
  store.send("SLAM_UPDATE", keyframe_at(12));
  delta = {13'000'000, 0, 1, 2, {}, {}, {}, {}};
  for (std::uint64_t i = 1; i <= 100; ++i) delta.moved.push_back(stem_at(i, 2.0));
  store.send("MAP_DELTA", delta);
  store.send("SLAM_UPDATE", keyframe_at(24));
  store.finish();

  const map_file::StoredMap map =
      map_file::MapFile(directory.path() / "maps" / "drive-0001.gpkg", map_file::Access::kRead)
          .read(1);
  REQUIRE(map.landmarks.size() == 100);
  for (const map_file::StoredLandmark& one : map.landmarks)
    CHECK(one.landmark.position_m.x() == 2.0);
}
