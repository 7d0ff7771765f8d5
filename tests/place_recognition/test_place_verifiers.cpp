// What every verifier behind the interface must do, and the two that associate landmarks against
// slow ones.
#include "common/place_recognition/place_verifier.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <tuple>

#include "common/place_recognition/verifiers/correspondence_graph.hpp"
#include "common/place_recognition/verifiers/hough_association.hpp"
#include "tests/catch.hpp"
#include "tests/place_recognition/place_scene.hpp"

using namespace understory;
using namespace understory::place_recognition;
using namespace understory::place_recognition::verifiers;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string any_verifier() {
  return GENERATE(from_range(std::vector<std::string>(
      {"correspondence_graph", "hough", "icp_point_to_point", "icp_point_to_plane",
       "generalised_icp", "scan_context", "stem_likelihood"})));
}

bool is_icp(const std::string& name) { return name.find("icp") != std::string::npos; }

/// A frame with a cloud, and a query that was taken beside it: another draw of noise and of points,
/// a third of the landmarks missed.
struct Pair {
  PlaceFrame frame;
  PlaceFrame query;
  geometry::SE2 frame_T_query;

  Pair(std::mt19937_64& random, const geometry::SE2& motion, double sigma_m = 0.03)
      : frame(test::random_frame(random, 30)), frame_T_query(motion) {
    query = frame;
    query.cloud = test::random_cloud(frame, 0.02, random);
    frame.cloud = test::random_cloud(frame, 0.02, random);
    std::shuffle(query.landmarks.begin(), query.landmarks.end(), random);
    query.landmarks.resize(20);
    query = test::seen_from(query, motion);
    test::disturb(query, sigma_m, random);
    test::disturb(frame, sigma_m, random);
  }

  /// The truth, off by half a metre and some degrees.
  std::vector<geometry::SE2WithCovariance> guess(std::mt19937_64& random) const {
    return {{frame_T_query * test::random_motion(random, 0.5, 0.06),
             Eigen::Vector3d(0.25, 0.25, 0.01).asDiagonal()}};
  }
};

}  // namespace

TEST_CASE("The factory of verifiers knows the names and refuses others", "[verifiers]") {
  CHECK(verifier_names().size() == 7);
  for (const std::string& name : verifier_names()) CHECK(make_verifier(name) != nullptr);
  CHECK_THROWS_WITH(make_verifier("gicp"),
                    Catch::Contains("\"gicp\"") && Catch::Contains("generalised_icp"));
}

TEST_CASE("Every verifier finds how two frames of one place lie", "[verifiers]") {
  const std::string name = any_verifier();
  CAPTURE(name);
  const auto verifier = make_verifier(name);
  std::mt19937_64 random(1);
  int right = 0;
  const int trials = 25;
  for (int trial = 0; trial < trials; ++trial) {
    // Scan Context finds a heading alone, of frames at one place.
    const double reach_m = name == "scan_context" ? 0.5 : 3.0;
    const Pair pair(random, test::random_motion(random, reach_m, 3.1));
    const auto guesses =
        is_icp(name) ? pair.guess(random) : std::vector<geometry::SE2WithCovariance>{};
    const auto found = verifier->verify(pair.query, pair.frame, guesses);
    if (!found) continue;
    CHECK(std::isfinite(found->score));
    const Eigen::Vector3d error = (found->frame_T_query.inverse() * pair.frame_T_query).Log();
    const double limit_m = name == "scan_context" ? 3.0 : 0.15;
    right += error.head<2>().norm() < limit_m && std::abs(error.z()) < 0.11 ? 1 : 0;
    CHECK(found->covariance.llt().info() == Eigen::Success);
  }
  CHECK(right >= trials - 2);
}

TEST_CASE("Two frames of one place score higher than frames of two", "[verifiers]") {
  const std::string name = any_verifier();
  CAPTURE(name);
  const auto verifier = make_verifier(name);
  std::mt19937_64 random(2);
  int higher = 0;
  const int trials = 15;
  for (int trial = 0; trial < trials; ++trial) {
    const Pair pair(random, test::random_motion(random, 0.5, 0.2));
    const Pair other(random, {});
    const auto same = verifier->verify(pair.query, pair.frame, {});
    const auto unlike = verifier->verify(pair.query, other.frame, {});
    higher += same && (!unlike || same->score > unlike->score) ? 1 : 0;
  }
  CHECK(higher >= trials - 2);
}

TEST_CASE("Verifiers take frames that say nothing", "[verifiers]") {
  const std::string name = any_verifier();
  CAPTURE(name);
  const auto verifier = make_verifier(name);
  std::mt19937_64 random(3);
  const Pair pair(random, {});
  PlaceFrame empty, one, broken, alike, line;
  one.landmarks.push_back({{1.0, 2.0, 0.0}, 0.3});
  broken.landmarks.assign(5, {{kNan, 1.0, 0.0}, 0.3});
  broken.cloud.assign(9, Eigen::Vector3f(std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F));
  alike.landmarks.assign(9, {{3.0, 3.0, 0.0}, 0.2});
  for (int i = 0; i < 9; ++i) line.landmarks.push_back({{i - 4.0, 0.0, 0.0}, 0.2});
  for (const PlaceFrame* bad : {&empty, &broken}) {
    CHECK_FALSE(verifier->verify(*bad, *bad));
    CHECK_FALSE(verifier->verify(*bad, pair.frame));
    CHECK_FALSE(verifier->verify(pair.query, *bad));
  }
  for (const PlaceFrame* odd : {&one, &alike, &line}) {
    for (const PlaceFrame* other : {odd, &pair.frame}) {
      const auto found = verifier->verify(*odd, *other);
      if (!found) continue;
      CHECK(std::isfinite(found->score));
      CHECK(found->covariance.allFinite());
      CHECK(found->frame_T_query.coordinates().allFinite());
    }
  }
}

TEST_CASE("Covariances of landmark verifiers are those of their errors", "[verifiers]") {
  const std::string name =
      GENERATE(as<std::string>(), "correspondence_graph", "hough", "stem_likelihood");
  CAPTURE(name);
  VerifierParameters parameters;
  // Both frames have noise of 5 cm per axis: what the stated noise of a difference is.
  parameters.sigma_m = std::sqrt(2.0) * 0.05;
  const auto verifier = make_verifier(name, parameters);
  std::mt19937_64 random(4);
  double sum = 0.0;
  int count = 0;
  for (int trial = 0; trial < 120; ++trial) {
    const Pair pair(random, test::random_motion(random, 2.0, 3.1), 0.05);
    const auto found = verifier->verify(pair.query, pair.frame);
    REQUIRE(found);
    const Eigen::Vector3d error = (found->frame_T_query.inverse() * pair.frame_T_query).Log();
    if (error.norm() > 1.0) continue;
    sum += error.dot(found->covariance.ldlt().solve(error));
    ++count;
  }
  CHECK(count >= 115);
  // The mean of a chi-squared with 3 degrees over 120 trials: sigma 0.22. Noise is taken as what
  // pairs show where that is more, so it is a little cautious.
  const double nees = sum / count;
  CHECK(nees > 1.8);
  CHECK(nees < 3.8);
}

TEST_CASE("Scan Context's covariance holds for frames within its place", "[verifiers]") {
  const auto verifier = make_verifier("scan_context");
  std::mt19937_64 random(5);
  std::normal_distribution<double> off(0.0, 1.0);
  double heading = 0.0, place = 0.0;
  int wrong = 0;
  const int trials = 60;
  for (int trial = 0; trial < trials; ++trial) {
    const double x = off(random);
    const double y = off(random);
    const Pair pair(random, geometry::SE2(x, y, 3.1 * off(random)));
    const auto found = verifier->verify(pair.query, pair.frame);
    REQUIRE(found);
    const Eigen::Vector3d error = (found->frame_T_query.inverse() * pair.frame_T_query).Log();
    place += error.head<2>().squaredNorm() / found->covariance(0, 0) / trials;
    // Another shift fits by chance: no covariance says that.
    if (std::abs(error.z()) > 0.7) ++wrong;
    if (std::abs(error.z()) <= 0.7)
      heading += error.z() * error.z() / found->covariance(2, 2) / trials;
  }
  CHECK(place < 2.5);
  CHECK(heading < 1.5);
  CHECK(wrong <= 6);
}

TEST_CASE("The correspondence graph has the edges of equation 2.33", "[verifiers]") {
  std::mt19937_64 random(6);
  CorrespondenceGraphParameters parameters;
  parameters.tolerance_m = 1.0;
  for (int trial = 0; trial < 10; ++trial) {
    const auto query = level_stems(test::random_frame(random, 6));
    const auto frame = level_stems(test::random_frame(random, 7));
    const CorrespondenceGraph built = correspondence_graph({query, frame}, parameters);
    REQUIRE(built.graph.size() == built.pairs.size());
    for (std::size_t a = 0; a < built.pairs.size(); ++a) {
      const LandmarkPair& one = built.pairs[a];
      CHECK(std::abs(std::log(query[one.query].diameter_m / frame[one.frame].diameter_m)) <= 0.7);
      for (std::size_t b = 0; b < built.pairs.size(); ++b) {
        const LandmarkPair& other = built.pairs[b];
        const double of_query =
            (query[one.query].position_m - query[other.query].position_m).norm();
        const double of_frame =
            (frame[one.frame].position_m - frame[other.frame].position_m).norm();
        const bool wanted = one.query != other.query && one.frame != other.frame &&
                            std::abs(of_query - of_frame) <= parameters.tolerance_m;
        CHECK((a != b && built.graph.connected(a, b)) == wanted);
      }
    }
  }
}

TEST_CASE("A mirrored place is not taken for the place", "[verifiers]") {
  const std::string name =
      GENERATE(as<std::string>(), "correspondence_graph", "hough", "stem_likelihood");
  CAPTURE(name);
  const auto verifier = make_verifier(name);
  std::mt19937_64 random(7);
  for (int trial = 0; trial < 10; ++trial) {
    const Pair pair(random, {});
    PlaceFrame mirrored = pair.query;
    for (PlaceLandmark& landmark : mirrored.landmarks) landmark.position_m.x() *= -1.0;
    const auto same = verifier->verify(pair.query, pair.frame);
    const auto found = verifier->verify(mirrored, pair.frame);
    REQUIRE(same);
    CHECK((!found || found->score < 0.6 * same->score));
  }
}

TEST_CASE("Hough cells have the votes of all pairs and headings", "[verifiers]") {
  std::mt19937_64 random(8);
  HoughParameters parameters;
  parameters.cell_rad = 2.0 * std::numbers::pi / 24.0;
  parameters.cell_m = 1.0;
  parameters.max_distance_m = 8.0;
  for (int trial = 0; trial < 10; ++trial) {
    const auto query = level_stems(test::random_frame(random, 35));
    const auto frame = level_stems(test::random_frame(random, 30));
    std::map<std::tuple<int, int, int>, std::size_t> votes;
    for (int k = 0; k < 24; ++k) {
      const double theta = 2.0 * std::numbers::pi * k / 24.0;
      for (const LevelStem& s : query) {
        for (const LevelStem& t : frame) {
          const double x = t.position_m.x() - std::cos(theta) * s.position_m.x() +
                           std::sin(theta) * s.position_m.y();
          const double y = t.position_m.y() - std::sin(theta) * s.position_m.x() -
                           std::cos(theta) * s.position_m.y();
          if (std::abs(x) >= 8.0 || std::abs(y) >= 8.0) continue;
          ++votes[{k, static_cast<int>(std::floor(x + 8.0)),
                   static_cast<int>(std::floor(y + 8.0))}];
        }
      }
    }
    std::vector<std::size_t> slow;
    for (const auto& cell : votes) {
      if (cell.second >= 2) slow.push_back(cell.second);
    }
    std::sort(slow.rbegin(), slow.rend());

    const auto cells = hough_cells({query, frame}, parameters);
    REQUIRE(cells.size() == std::min(slow.size(), parameters.most_cells));
    REQUIRE(cells.size() > 5);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      CHECK(cells[i].votes == slow[i]);
      const geometry::SE2& at = cells[i].frame_T_query;
      const double turn = at.theta() < -1e-9 ? at.theta() + 2.0 * std::numbers::pi : at.theta();
      const int k = static_cast<int>(std::lround(turn * 24.0 / (2.0 * std::numbers::pi))) % 24;
      CHECK(votes.at({k, static_cast<int>(std::floor(at.x() + 8.0)),
                      static_cast<int>(std::floor(at.y() + 8.0))}) == cells[i].votes);
    }
  }
}
