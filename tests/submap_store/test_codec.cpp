// Submaps' parts as bytes: back as they were, or not at all.
#include <Eigen/Eigenvalues>

#include "common/map_file/submap_codec.hpp"
#include "tests/submap_store/store_fixture.hpp"

using namespace understory;
using namespace understory::test;

TEST_CASE("landmarks come back within the rounding, and stay covariances", "[submap_store]") {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(-7.0, 3.0);
  for (int trial = 0; trial < 200; ++trial) {
    model::Submap submap = random_submap(1 + random() % 100, 1 + random() % 1000, random);
    for (model::MapLandmark& one : submap.landmarks)
      one.covariance_m2 *= std::pow(10.0, exponent(random));
    submap.landmarks[0].covariance_m2.setZero();
    const auto bytes = map_file::landmark_bytes(submap.landmarks);
    const auto back = map_file::landmarks_in(bytes);
    REQUIRE(back);
    model::Submap again = submap;
    again.landmarks = *back;
    check_same(submap, again);
    CHECK(back->front().covariance_m2.isZero(0.0));
    for (std::size_t i = 1; i < back->size(); ++i) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver((*back)[i].covariance_m2);
      CHECK(solver.eigenvalues().minCoeff() > 0.0);
    }
  }
}

TEST_CASE("keyframes, numbers and borders come back", "[submap_store]") {
  std::mt19937_64 random(2);
  const model::Submap submap = random_submap(3, 7, random);
  model::Submap again = submap;
  again.keyframes = map_file::keyframes_in(map_file::keyframe_bytes(submap.keyframes)).value();
  check_same(submap, again);
  const std::vector<model::SubmapId> ids{1, 127, 128, 1'000'000'007, std::uint64_t{1} << 62U};
  CHECK(map_file::ids_in(map_file::id_bytes(ids)) == ids);
  CHECK(map_file::ids_in(map_file::id_bytes({}))->empty());

  std::vector<Eigen::Vector2d> places;
  for (const auto& one : submap.landmarks) places.push_back(one.position_m);
  const auto border = map_file::border_around(places);
  const auto back = map_file::border_in(map_file::border_bytes(border)).value();
  REQUIRE(back.size() == border.size());
  // Every place lies to the left of every side, by what the border is wider.
  for (std::size_t i = 0; i < back.size(); ++i) {
    const Eigen::Vector2d side = back[(i + 1) % back.size()] - back[i];
    for (const Eigen::Vector2d& place : places) {
      const Eigen::Vector2d to = place - back[i];
      CHECK(side.x() * to.y() - side.y() * to.x() > 0.4 * side.norm());
    }
  }
  CHECK(map_file::border_around(std::vector<Eigen::Vector2d>{{1.0, 2.0}}).size() == 4);
}

TEST_CASE("damaged bytes are told from whole ones", "[submap_store]") {
  std::mt19937_64 random(3);
  const model::Submap submap = random_submap(1, 1, random);
  const auto bytes = map_file::landmark_bytes(submap.landmarks);
  int found = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    auto turned = bytes;
    turned[i] ^= static_cast<std::uint8_t>(1U << (random() % 8));
    if (!map_file::landmarks_in(turned)) ++found;
  }
  // zlib's checksum; a bit of its header may mean nothing.
  CHECK(found >= static_cast<int>(bytes.size()) - 2);
  for (std::size_t size = 0; size < bytes.size(); size += 7)
    CHECK_FALSE(map_file::landmarks_in(std::span(bytes).first(size)));
  CHECK_FALSE(map_file::unpacked({}));
}
