// A part of a graph as one condensed measurement.
#include "common/factor_graph/plane/condense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <random>
#include <set>

#include "common/factor_graph/plane/smoother.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::factor_graph;

namespace {

constexpr double kStep_m = 1.6;
constexpr double kRange_m = 40.0;
constexpr double kPointSigma_m = 0.07;
constexpr std::size_t kPoses = 40;
/// The part: the poses from here to before there.
constexpr std::size_t kBegin = 12;
constexpr std::size_t kEnd = 25;

/// A drive among points with wheels that know little of the heading, in a slight bend.
struct Drive {
  plane::Graph truth;
  plane::Graph graph;
};

Drive drive(std::uint64_t seed, std::size_t points) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> along(-30.0, kPoses * kStep_m + 30.0);
  std::uniform_real_distribution<double> across(-30.0, 30.0);
  Drive result;
  geometry::SE2 pose;
  for (std::size_t i = 0; i < kPoses; ++i) {
    result.truth.add_pose(pose);
    pose = pose * geometry::SE2(kStep_m, 0.0, 0.01);
  }
  for (std::size_t i = 0; i < points; ++i) result.truth.add_point({along(random), across(random)});

  // Measured.
  result.graph = result.truth;
  const double sigma = 0.03;
  const Eigen::Vector3d sigmas(sigma, sigma, 0.01);
  const Eigen::Matrix3d information = sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
  for (std::uint32_t i = 1; i < kPoses; ++i) {
    const auto a = plane::PoseId(i - 1);
    const auto b = plane::PoseId(i);
    const geometry::SE2 motion = result.truth[a].inverse() * result.truth[b];
    const Eigen::Vector3d noise(sigmas.x() * normal(random), sigmas.y() * normal(random),
                                sigmas.z() * normal(random));
    result.graph.relative_poses.push_back(
        {a, b, motion * geometry::SE2(noise.x(), noise.y(), noise.z()), information});
  }
  const Eigen::Matrix2d seen = Eigen::Matrix2d::Identity() / (kPointSigma_m * kPointSigma_m);
  for (std::uint32_t i = 0; i < kPoses; ++i) {
    for (std::uint32_t k = 0; k < points; ++k) {
      const auto from = plane::PoseId(i);
      const auto point = plane::PointId(k);
      const Eigen::Vector2d local = result.truth[from].inverse() * result.truth[point];
      if (local.norm() > kRange_m) continue;
      const Eigen::Vector2d noise(normal(random), normal(random));
      result.graph.observations.push_back({from, point, local + kPointSigma_m * noise, seen});
    }
  }
  result.graph.pose_priors.push_back(
      {plane::PoseId(0), result.truth.poses[0], 1e8 * Eigen::Matrix3d::Identity()});
  return result;
}

bool is_inner(plane::PoseId id) { return index(id) >= kBegin && index(id) < kEnd; }
bool is_inner(const plane::RelativePose& f) { return is_inner(f.a) || is_inner(f.b); }

plane::Graph solved(const plane::Graph& graph) {
  plane::Smoother smoother;
  smoother.start_from(graph);
  for (int i = 0; i < 5; ++i) REQUIRE(smoother.update().ok);
  return smoother.graph();
}

/// The poses kBegin to kEnd, the one before and the one after them, and what they saw.
struct Part {
  plane::Graph graph;
  std::vector<plane::PointId> points;  ///< Their numbers in the whole.
};

Part part_of(const plane::Graph& graph) {
  Part part;
  for (std::size_t i = kBegin; i < kEnd; ++i) part.graph.add_pose(graph.poses[i]);
  part.graph.add_pose(graph.poses[kBegin - 1]);
  part.graph.add_pose(graph.poses[kEnd]);
  const auto number = [](plane::PoseId id) {
    if (is_inner(id)) return plane::PoseId(static_cast<std::uint32_t>(index(id) - kBegin));
    const std::size_t outer = kEnd - kBegin + (index(id) == kEnd ? 1 : 0);
    return plane::PoseId(static_cast<std::uint32_t>(outer));
  };
  for (plane::RelativePose factor : graph.relative_poses) {
    if (!is_inner(factor)) continue;
    factor.a = number(factor.a);
    factor.b = number(factor.b);
    part.graph.relative_poses.push_back(factor);
  }
  for (plane::PointObservation factor : graph.observations) {
    if (!is_inner(factor.pose)) continue;
    auto found = std::find(part.points.begin(), part.points.end(), factor.point);
    if (found == part.points.end()) {
      part.graph.add_point(graph[factor.point]);
      found = part.points.insert(part.points.end(), factor.point);
    }
    factor.pose = number(factor.pose);
    factor.point = plane::PointId(static_cast<std::uint32_t>(found - part.points.begin()));
    part.graph.observations.push_back(factor);
  }
  return part;
}

/// The graph with one pose in the place of the part; the last one.
plane::Graph with_condensed(const plane::Graph& graph, const Part& part,
                            const plane::CondensedPart& condensed) {
  plane::Graph result = graph;
  std::erase_if(result.relative_poses, [](const auto& factor) { return is_inner(factor); });
  std::erase_if(result.observations, [](const auto& factor) { return is_inner(factor.pose); });
  const plane::PoseId origin = result.add_pose(condensed.map_T_origin);
  for (std::size_t i = 0; i < part.points.size(); ++i) {
    const plane::CondensedPoint& point = condensed.points[i];
    result.observations.push_back(
        {origin, part.points[i], point.position, point.covariance.inverse()});
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& motion = condensed.outer[i].origin_T_outer;
    result.relative_poses.push_back(
        {origin, plane::PoseId(static_cast<std::uint32_t>(i == 0 ? kBegin - 1 : kEnd)), motion.mean,
         motion.covariance.inverse()});
  }
  return result;
}

Eigen::Matrix3d covariance_of_last(const plane::Graph& graph) {
  plane::Smoother smoother;
  smoother.start_from(graph);
  REQUIRE(smoother.update().ok);
  const auto last = plane::PoseId(kPoses - 1);
  return *smoother.joint_marginal({&last, 1}, {});
}

}  // namespace

TEST_CASE("A condensed part leaves the rest of the graph where it was", "[plane]") {
  double squared_off = 0.0;     // off the whole solution, by its own sigma
  double smallest_ratio = 1e9;  // of the last pose's variances
  double largest_ratio = 0.0;
  constexpr int kTrials = 20;
  for (std::uint64_t seed = 1; seed <= kTrials; ++seed) {
    const Drive one = drive(seed, 60);
    const plane::Graph whole = solved(one.graph);
    const Part part = part_of(whole);
    const auto condensed = plane::condense(part.graph, kEnd - kBegin);
    REQUIRE(condensed);
    const plane::Graph short_one = solved(with_condensed(whole, part, *condensed));

    const Eigen::Matrix3d covariance = covariance_of_last(whole);
    const Eigen::Vector3d off =
        (whole.poses[kPoses - 1].inverse() * short_one.poses[kPoses - 1]).Log();
    squared_off += off.dot(covariance.inverse() * off) / 3.0;
    const Eigen::Matrix3d other = covariance_of_last(short_one);
    for (int k = 0; k < 3; ++k) {
      const double ratio = other(k, k) / covariance(k, k);
      smallest_ratio = std::min(smallest_ratio, ratio);
      largest_ratio = std::max(largest_ratio, ratio);
    }
  }
  INFO("variances " << smallest_ratio << " to " << largest_ratio);
  CHECK(squared_off / kTrials < 0.02);
  CHECK(smallest_ratio > 0.85);
  CHECK(largest_ratio < 1.1);
}

TEST_CASE("What a part tells of its points is as exact as it says", "[plane]") {
  // Against the truth, with the origin where the points have it: each point's error by itself.
  double nees = 0.0;
  std::size_t count = 0;
  for (std::uint64_t seed = 100; seed < 130; ++seed) {
    const Drive one = drive(seed, 60);
    const Part part = part_of(one.graph);
    const auto condensed = plane::condense(part.graph, kEnd - kBegin);
    REQUIRE(condensed);

    // The origin in truth: the frame that fits best.
    plane::Graph fit;
    const plane::PoseId origin = fit.add_pose(condensed->map_T_origin);
    for (std::size_t i = 0; i < part.points.size(); ++i) {
      const plane::PointId point = fit.add_point(one.truth[part.points[i]]);
      fit.point_priors.push_back(
          {point, one.truth[part.points[i]], 1e10 * Eigen::Matrix2d::Identity()});
      const plane::CondensedPoint& told = condensed->points[i];
      fit.observations.push_back({origin, point, told.position, told.covariance.inverse()});
    }
    fit = solved(fit);
    for (const plane::PointObservation& factor : fit.observations) nees += chi2(fit, factor);
    count += 2 * fit.observations.size() - 3;
  }
  nees /= static_cast<double>(count);
  INFO("NEES per degree of freedom " << nees << " of " << count);
  CHECK(nees > 0.93);
  CHECK(nees < 1.07);
}

TEST_CASE("A pose alone keeps what it observed", "[plane]") {
  plane::Graph part;
  const auto pose = part.add_pose(geometry::SE2(3.0, -1.0, 0.7));
  Eigen::Matrix2d covariance;
  covariance << 0.04, 0.01, 0.01, 0.09;
  std::vector<Eigen::Vector2d> seen;
  for (const Eigen::Vector2d& place :
       {Eigen::Vector2d(4.0, 1.0), Eigen::Vector2d(-2.0, 6.0), Eigen::Vector2d(0.5, -3.0)}) {
    seen.push_back(place);
    const auto point = part.add_point(part[pose] * place);
    part.observations.push_back({pose, point, place, covariance.inverse()});
  }

  const auto condensed = plane::condense(part, 1);
  REQUIRE(condensed);
  CHECK((part[pose].inverse() * condensed->map_T_origin).Log().norm() < 1e-12);
  CHECK(condensed->origin_T_inner.at(0).covariance.norm() < 1e-12);
  CHECK(condensed->outer.empty());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    CHECK((condensed->points[i].position - seen[i]).norm() < 1e-12);
    CHECK(condensed->points[i].covariance.isApprox(covariance, 1e-9));
  }
}

TEST_CASE("The motions of a part without points are compounded", "[plane]") {
  plane::Graph chain;
  const Eigen::Matrix3d information = Eigen::Vector3d(400.0, 900.0, 1e4).asDiagonal();
  const geometry::SE2 step(2.0, 0.3, 0.1);
  geometry::SE2 pose;
  // Three inner ones, then the one after and the one before.
  for (int i = 0; i < 3; ++i, pose = pose * step) chain.add_pose(pose);
  chain.add_pose(pose);
  chain.add_pose(step.inverse());
  const auto id = [](std::uint32_t i) { return plane::PoseId(i); };
  chain.relative_poses = {{id(0), id(1), step, information},
                          {id(1), id(2), step, information},
                          {id(2), id(3), step, information},
                          {id(4), id(0), step, information}};
  const auto condensed = plane::condense(chain, 3);
  REQUIRE(condensed);

  const geometry::SE2WithCovariance one{step, information.inverse()};
  const auto after = compound(one, one);
  CHECK((condensed->outer[0].origin_T_outer.mean.inverse() * after.mean).Log().norm() < 1e-9);
  CHECK(condensed->outer[0].origin_T_outer.covariance.isApprox(after.covariance, 1e-6));
  const auto before = inverse(after);
  CHECK(condensed->outer[1].origin_T_outer.covariance.isApprox(before.covariance, 1e-6));
  CHECK(condensed->origin_T_inner[1].covariance.norm() < 1e-12);
}

TEST_CASE("A gyro's bias is told by the points, and moves what no point holds", "[plane]") {
  const double bias = 0.002;
  const double seconds = 0.5;
  const geometry::SE2 step(1.0, 0.0, 0.0);
  const Eigen::Matrix3d information = Eigen::Vector3d(1e4, 1e4, 1e8).asDiagonal();
  const auto chain = [&](bool with_points) {
    plane::Graph graph;
    geometry::SE2 pose;
    for (int i = 0; i < 6; ++i, pose = pose * step) graph.add_pose(pose);
    graph.scalars = {0.0};
    const geometry::SE2 measured(1.0, 0.0, bias * seconds);
    for (std::uint32_t i = 1; i < 6; ++i) {
      graph.biased_relative_poses.push_back(
          {{plane::PoseId(i - 1), plane::PoseId(i), measured, information},
           plane::ScalarId(0),
           seconds});
    }
    for (std::uint32_t k = 0; with_points && k < 4; ++k) {
      const plane::PointId point = graph.add_point({5.0 * k - 5.0, k % 2 == 0 ? 10.0 : -10.0});
      for (std::uint32_t i = 0; i < 5; ++i) {
        const Eigen::Vector2d local = graph.poses[i].inverse() * graph.points[k];
        graph.observations.push_back(
            {plane::PoseId(i), point, local, 1e6 * Eigen::Matrix2d::Identity()});
      }
    }
    return graph;
  };

  const auto told = plane::condense(chain(true), 5);
  REQUIRE(told);
  CHECK(told->bias_step == Approx(bias).epsilon(0.02));
  CHECK(told->bias_information > 1e5);
  CHECK(told->outer[0].seconds == Approx(seconds).epsilon(0.2));

  // Nothing but the gyro: from the middle to the end it all depends on the bias.
  const auto blind = plane::condense(chain(false), 5);
  REQUIRE(blind);
  CHECK(blind->bias_information == 0.0);
  CHECK(blind->outer[0].seconds == Approx(3.0 * seconds).epsilon(1e-6));
}

TEST_CASE("A part that leaves a pose undetermined is not condensed", "[plane]") {
  plane::Graph graph;
  graph.add_pose({});
  graph.add_pose({1.0, 0.0, 0.0});
  graph.add_pose({2.0, 0.0, 0.0});
  graph.relative_poses.push_back(
      {plane::PoseId(0), plane::PoseId(1), {1.0, 0.0, 0.0}, Eigen::Matrix3d::Identity()});
  CHECK_FALSE(plane::condense(graph, 3));
  CHECK_FALSE(plane::condense(plane::Graph{}, 0));
}
