// The parts of the loop closer.
#include <random>

#include "services/loop_closer/expectation.hpp"
#include "services/loop_closer/known_ground.hpp"
#include "services/loop_closer/place_search.hpp"
#include "services/loop_closer/place_window.hpp"
#include "services/loop_closer/sent_closures.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::loop_closer;

namespace {

Place place_at(const geometry::SE2& pose, const Eigen::Vector3d& sigma) {
  Place place;
  place.map_T_base = {pose, sigma.array().square().matrix().asDiagonal()};
  return place;
}

/// A keyframe of stems at true places, and the update of a mapper that is right.
std::pair<model::Keyframe, model::MapUpdate> seen_at(const geometry::SE2& pose,
                                                     std::uint64_t sequence,
                                                     const std::vector<Eigen::Vector2d>& stems) {
  model::Keyframe keyframe;
  keyframe.sequence = sequence;
  // The base is not the centre.
  const geometry::SE2 centre_T_base(0.3, -0.2, 0.1);
  keyframe.members.push_back({0, sequence, centre_T_base, Eigen::Matrix3d::Zero()});
  model::MapUpdate update;
  update.keyframe_sequence = sequence;
  update.map_T_vehicle = pose;
  for (std::size_t i = 0; i < stems.size(); ++i) {
    model::KeyframeLandmark landmark;
    landmark.position_m = centre_T_base * (pose.inverse() * stems[i]);
    landmark.radius_m = 0.1 + 0.05 * static_cast<double>(i);
    keyframe.landmarks.push_back(landmark);
    update.associations.push_back({static_cast<std::uint32_t>(i), i + 1});
  }
  return {keyframe, update};
}

}  // namespace

TEST_CASE("A window joins what its keyframes saw, around the last base", "[loop_closer]") {
  const std::vector<Eigen::Vector2d> stems{{5.0, 2.0}, {8.0, -3.0}, {2.0, 6.0}};
  PlaceParameters parameters;
  parameters.window_m = 10.0;
  PlaceWindow window(parameters);
  geometry::SE2 pose;
  for (std::uint64_t k = 0; k < 5; ++k) {
    pose = geometry::SE2(1.0 * static_cast<double>(k), 0.1, 0.05 * static_cast<double>(k));
    // Each sees two of the three.
    const auto [keyframe, update] = seen_at(pose, k, {stems[k % 3], stems[(k + 1) % 3]});
    model::MapUpdate named = update;
    named.associations = {{0, k % 3 + 1}, {1, (k + 1) % 3 + 1}};
    window.add(keyframe, named);
  }

  const auto joined = window.stems();
  REQUIRE(joined.size() == 3);
  for (const Eigen::Vector2d& stem : stems) {
    const Eigen::Vector2d wanted = pose.inverse() * stem;
    CHECK(std::ranges::any_of(joined, [&](const LevelStem& one) {
      return (one.position_m - wanted).norm() < 1e-9 && one.diameter_m > 0.1;
    }));
  }

  // Far on, they are forgotten; and where the map was corrected, too.
  const auto [far_keyframe, far_update] = seen_at({40.0, 0.0, 0.0}, 9, {{41.0, 3.0}});
  window.add(far_keyframe, far_update);
  CHECK(window.stems().size() == 1);
}

TEST_CASE("Detections that come once are no stems of a window, unless it shows few",
          "[loop_closer]") {
  PlaceParameters parameters;
  parameters.window_m = 20.0;
  for (const int trunks : {4, 5, 12}) {
    PlaceWindow window(parameters);
    const std::uint64_t keyframes = 6;
    for (std::uint64_t k = 0; k < keyframes; ++k) {
      // Each trunk in two keyframes, and one false detection in each keyframe.
      std::vector<Eigen::Vector2d> seen{{100.0 + 5.0 * static_cast<double>(k), 0.0}};
      for (int trunk = 0; trunk < trunks; ++trunk)
        if (static_cast<std::uint64_t>(trunk % 5) == k ||
            static_cast<std::uint64_t>(trunk % 5 + 1) == k)
          seen.emplace_back(2.0 * trunk, 10.0);
      auto [keyframe, update] = seen_at({2.0 * static_cast<double>(k), 0.0, 0.0}, k, seen);
      update.associations.clear();  // The mapper has none of them yet.
      window.add(keyframe, update);
    }
    const std::size_t all = static_cast<std::size_t>(trunks) + keyframes;
    const bool is_thin = trunks < parameters.min_stems;
    CHECK(window.stems().size() == (is_thin ? all : static_cast<std::size_t>(trunks)));
  }
}

TEST_CASE("A window begins anew where the map was corrected", "[loop_closer]") {
  PlaceWindow window(PlaceParameters{});
  auto [first, first_update] = seen_at({}, 1, {{3.0, 4.0}, {6.0, 1.0}});
  window.add(first, first_update);
  auto [next, next_update] = seen_at({1.0, 3.0, 0.0}, 2, {{9.0, 9.0}});
  next.previous_T_base = geometry::SE2(1.0, 0.0, 0.0);
  next_update.associations = {{0, 7}};
  window.add(next, next_update);
  CHECK(window.stems().size() == 1);
}

TEST_CASE("The poses that an expectation allows are those of its ellipse", "[loop_closer]") {
  const Place query = place_at({20.0, 0.0, 0.0}, {1.5, 0.5, 0.05});
  std::vector<Place> places{place_at({19.0, 1.0, 0.2}, {0.5, 1.0, 0.02})};
  const double gate = 3.0;
  const double allowed = allowed_poses(places, query, gate, 50.0);

  // Brute force: cells of a grid in the ellipse, times those of the heading.
  const geometry::SE2WithCovariance pose = expected(places.front(), query);
  const Eigen::Matrix2d information = pose.covariance.topLeftCorner<2, 2>().inverse();
  double cells = 0.0;
  for (double x = -10.0; x < 10.0; x += kPoseCellM)
    for (double y = -10.0; y < 10.0; y += kPoseCellM)
      cells += Eigen::Vector2d(x, y).dot(information * Eigen::Vector2d(x, y)) < gate * gate;
  cells *= 2.0 * gate * std::sqrt(pose.covariance(2, 2)) / kPoseCellRad;
  CHECK(allowed == Approx(cells).epsilon(0.02));

  places.push_back(place_at({500.0, 0.0, 0.0}, {0.5, 1.0, 0.02}));  // Out of reach.
  CHECK(allowed_poses(places, query, gate, 50.0) == allowed);
  places.back().map_T_base.mean = places.front().map_T_base.mean;
  CHECK(allowed_poses(places, query, gate, 50.0) == Approx(2.0 * allowed).epsilon(0.2));
  places.back().map_id = 2;
  CHECK(allowed_poses(places, query, gate, 50.0) == allowed);
}

TEST_CASE("What is expected holds what is true", "[loop_closer]") {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const Eigen::Vector3d sigma(0.8, 0.6, 0.03);
  const geometry::SE2 a(3.0, 8.0, 1.0);
  const geometry::SE2 b(9.0, -4.0, -2.0);
  double sum = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const auto noisy = [&](const geometry::SE2& pose) {
      const double x = normal(random), y = normal(random), z = normal(random);
      return pose * geometry::SE2::Exp(sigma.cwiseProduct(Eigen::Vector3d(x, y, z)));
    };
    const auto relative = expected(place_at(noisy(a), sigma), place_at(noisy(b), sigma));
    sum += squared_distance(relative, {a.inverse() * b, Eigen::Matrix3d::Zero()});
  }
  CHECK(sum / 2000.0 < 3.1);
  CHECK(sum / 2000.0 > 1.2);  // The least uncertainty is in it.
}

TEST_CASE("Ground is known by landmarks that were there a good way back", "[loop_closer]") {
  KnownGround ground(100.0);
  model::MapUpdate update;
  for (int k = 0; k < 200; ++k) {
    update.associations.clear();
    for (std::uint32_t i = 0; i < 6; ++i)
      update.associations.push_back(
          {i, static_cast<model::LandmarkId>(k + 1 + static_cast<int>(i))});
    ground.add(update, 1.0 * k);
    CHECK_FALSE(ground.is_known(0.5));
  }
  // Three of six are of the first metres, for so long that nothing else counts.
  for (std::uint32_t i = 0; i < 3; ++i) update.associations[i].landmark_id = i + 1;
  for (int k = 200; k < 205; ++k) ground.add(update, 1.0 * k);
  CHECK(ground.is_known(0.5));
  CHECK_FALSE(ground.is_known(0.6));
  for (int k = 205; k < 210; ++k) ground.add({}, 1.0 * k);
  CHECK_FALSE(ground.is_known(0.5));
}

TEST_CASE("What was sent is remembered, and what was revoked speaks against its like",
          "[loop_closer]") {
  using enum model::LoopResult::Status;
  SentClosures sent;
  sent.add(5, {10.0, 500.0});
  CHECK_FALSE(sent.note({0, 0, 1, 6, kAccepted, ""}));
  CHECK(sent.note({0, 0, 1, 5, kWaiting, ""}));
  CHECK(sent.accepted_at_m() < 0.0);
  CHECK(sent.note({0, 0, 1, 5, kAccepted, ""}));
  CHECK(sent.accepted_at_m() == 500.0);
  CHECK_FALSE(sent.was_revoked({10.0, 500.0}));
  CHECK(sent.note({0, 0, 1, 5, kRevoked, ""}));
  CHECK(sent.was_revoked({30.0, 480.0}));
  CHECK_FALSE(sent.was_revoked({30.0, 600.0}));
  CHECK_FALSE(sent.was_revoked({90.0, 500.0}));
}
