#include "eval/experiments/closures/closure_drive.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

namespace understory::eval::experiments::closures {
namespace {

using geometry::SE2;

constexpr double kStep_m = 10.0;
/// Odometry of one step: 0.5 % of the path, 2 mrad. Closures: as the loop closer states them.
const Eigen::Vector3d kStepSigma(0.05, 0.02, 2e-3);
const Eigen::Vector3d kClosureSigma(0.06, 0.06, 4e-3);
/// Windows of an agreeing group see the same landmarks: their poses differ by little.
constexpr double kAlike = 0.5;
constexpr double kLeastLoop_m = 100.0;
constexpr double kNear_m = 8.0;

/// Points of a route 1 m apart or so, one list for each pass of it.
using Points = std::vector<Eigen::Vector2d>;

class DriveMaker {
 public:
  DriveMaker(const ClosurePlan& plan, std::uint64_t seed) : plan_(plan), random_(seed) {}

  ClosureDrive make(std::uint64_t shape) {
    drive_.truth = poses_along(route(shape % 3));
    measure();
    find_passes();
    for (int i = 0; i < plan_.rows; ++i) add_rows();
    add_right();
    for (int i = 0; i < plan_.alone; ++i) add_alone();
    for (int i = 0; i < plan_.groups; ++i) {
      add_window_group(Kind::kOneWindow);
      add_window_group(Kind::kSuccessive);
    }
    number_in_order();
    return std::move(drive_);
  }

 private:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  std::size_t any(std::size_t low, std::size_t high) {
    return std::uniform_int_distribution<std::size_t>(low, high)(random_);
  }
  double sign() { return uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0; }
  Eigen::Vector3d noise(const Eigen::Vector3d& sigma) {
    std::normal_distribution<double> normal;
    const double x = normal(random_), y = normal(random_), z = normal(random_);
    return sigma.cwiseProduct(Eigen::Vector3d(x, y, z));
  }

  Points route(std::uint64_t shape) {
    if (shape == 2) return there_and_back();
    const Points lap = shape == 0 ? rectangle() : wavy_ring();
    Points all;
    for (std::size_t i = 0; i < 3; ++i) all.insert(all.end(), lap.begin(), lap.end());
    return all;
  }
  Points rectangle() {
    const double a = uniform(180.0, 400.0), b = uniform(120.0, 300.0), r = 15.0;
    Points points;
    double heading = 0.0;
    Eigen::Vector2d at(0.0, 0.0);
    const auto go = [&](double length_m, double curvature) {
      for (int i = 0; i < static_cast<int>(length_m); ++i) {
        heading += curvature;
        at += Eigen::Vector2d(std::cos(heading), std::sin(heading));
        points.push_back(at);
      }
    };
    for (const double side : {a, b, a, b}) {
      go(side, 0.0);
      go(std::round(0.5 * std::numbers::pi * r),
         0.5 * std::numbers::pi / std::round(0.5 * std::numbers::pi * r));
    }
    return points;
  }
  Points wavy_ring() {
    const double r = uniform(110.0, 210.0), a = uniform(0.0, 6.28), b = uniform(0.0, 6.28);
    Points points;
    for (double phi = 0.0; phi < 2.0 * std::numbers::pi; phi += 1.0 / r) {
      const double radius_m =
          r * (1.0 + 0.15 * std::sin(2.0 * phi + a) + 0.08 * std::sin(5.0 * phi + b));
      points.emplace_back(radius_m * std::cos(phi), radius_m * std::sin(phi));
    }
    return points;
  }
  Points there_and_back() {
    Points way;
    double heading = 0.0, turn = 0.0;
    Eigen::Vector2d at(0.0, 0.0);
    for (double length_m = uniform(600.0, 1200.0); length_m > 0.0; length_m -= 1.0) {
      turn = 0.98 * turn + noise(Eigen::Vector3d::Constant(2e-3)).x();
      heading += std::clamp(turn, -0.05, 0.05);
      at += Eigen::Vector2d(std::cos(heading), std::sin(heading));
      way.push_back(at);
    }
    Points all = way;
    all.insert(all.end(), way.rbegin() + 5, way.rend());
    all.insert(all.end(), way.begin() + 5, way.end());
    return all;
  }

  /// A pose every 10 m; the vehicle is up to 1 m beside the route, and wanders slowly.
  std::vector<SE2> poses_along(const Points& points) {
    std::vector<SE2> poses;
    double since_m = kStep_m, aside_m = 0.0;
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {
      since_m += (points[i] - points[i - 1]).norm();
      if (since_m < kStep_m) continue;
      since_m -= kStep_m;
      aside_m = std::clamp(aside_m + noise(Eigen::Vector3d::Constant(0.3)).x(), -1.0, 1.0);
      const Eigen::Vector2d along = points[i + 1] - points[i];
      poses.push_back(SE2(points[i], std::atan2(along.y(), along.x())) * SE2(0.0, aside_m, 0.0));
    }
    const SE2 first = poses.front().inverse();
    for (SE2& pose : poses) pose = first * pose;
    return poses;
  }

  void measure() {
    const double bias = sign() * uniform(0.3, 1.0) * plan_.yaw_bias_rad;
    drive_.covariance = (plan_.stated * kStepSigma).array().square().matrix().asDiagonal();
    for (std::size_t i = 0; i + 1 < drive_.truth.size(); ++i) {
      const Eigen::Vector3d error = noise(kStepSigma) + Eigen::Vector3d(0.0, 0.0, bias);
      drive_.measured.push_back(drive_.truth[i].inverse() * drive_.truth[i + 1] * SE2::Exp(error));
    }
  }

  double distance_m(std::size_t i, std::size_t k) const {
    return (drive_.truth[i].translation() - drive_.truth[k].translation()).norm();
  }

  /// For each node the nearest one of an earlier pass, if it is near.
  void find_passes() {
    earlier_.resize(drive_.truth.size());
    taken_.assign(drive_.truth.size(), false);
    const auto apart = static_cast<std::size_t>(kLeastLoop_m / kStep_m);
    for (std::size_t k = apart; k < drive_.truth.size(); ++k) {
      std::size_t best = 0;
      for (std::size_t i = 0; i + apart <= k; ++i)
        if (distance_m(i, k) < distance_m(best, k)) best = i;
      if (distance_m(best, k) < kNear_m) earlier_[k] = best;
    }
  }

  SE2 end_within(std::size_t node, double along_m) const {
    if (node + 1 >= drive_.truth.size()) return {};
    const SE2 step = drive_.truth[node].inverse() * drive_.truth[node + 1];
    return SE2::Exp(along_m / kStep_m * step.Log());
  }
  SE2 world_T_end(std::size_t node, double along_m) const {
    return drive_.truth[node] * end_within(node, along_m);
  }

  /// A closure between two points of the path [m], with noise that it states.
  void send(Kind kind, int group, double from_m, double to_m, const SE2& from_T_to,
            double log10_false_alarm, double noise_share) {
    SentClosure sent;
    sent.kind = kind;
    sent.group = group;
    sent.from = static_cast<std::size_t>(from_m / kStep_m);
    sent.to = static_cast<std::size_t>(to_m / kStep_m);
    sent.from_T_end = end_within(sent.from, std::fmod(from_m, kStep_m));
    sent.to_T_end = end_within(sent.to, std::fmod(to_m, kStep_m));
    sent.closure.source = "stems";
    sent.closure.log10_false_alarm = log10_false_alarm;
    sent.closure.from_T_to.mean = from_T_to * SE2::Exp(noise_share * noise(kClosureSigma));
    sent.closure.from_T_to.covariance = kClosureSigma.array().square().matrix().asDiagonal();
    drive_.sent.push_back(sent);
  }
  SE2 true_between(double from_m, double to_m) const {
    const auto pose = [&](double at_m) {
      return world_T_end(static_cast<std::size_t>(at_m / kStep_m), std::fmod(at_m, kStep_m));
    };
    return pose(from_m).inverse() * pose(to_m);
  }

  /// On ground driven before: every third node or so.
  void add_right() {
    for (std::size_t k = 0; k + 1 < drive_.truth.size(); ++k) {
      if (!earlier_[k] || taken_[k] || uniform(0.0, 1.0) > 0.35) continue;
      const double from_m = kStep_m * static_cast<double>(*earlier_[k]);
      const double to_m = kStep_m * static_cast<double>(k);
      send(Kind::kRight, -1, from_m, to_m, true_between(from_m, to_m), uniform(-30.0, -6.0), 1.0);
    }
  }

  /// Two points of the path [m] that are no one place; the second has `room_m` of path after it.
  std::pair<double, double> two_places(double room_m) {
    const double length_m = kStep_m * static_cast<double>(drive_.truth.size() - 2);
    for (;;) {
      const double from_m = uniform(0.0, length_m - room_m - kLeastLoop_m);
      const double to_m = uniform(from_m + kLeastLoop_m, length_m - room_m);
      if (true_between(from_m, to_m).translation().norm() > 25.0) return {from_m, to_m};
    }
  }
  /// What a search that is wrong says: the vehicle is within 6 m of the other place.
  SE2 wrong_pose() {
    const double radius_m = uniform(0.0, 6.0), phi = uniform(-3.14, 3.14);
    return {radius_m * std::cos(phi), radius_m * std::sin(phi), uniform(-3.14, 3.14)};
  }
  void add_alone() {
    const auto [from_m, to_m] = two_places(20.0);
    send(Kind::kAlone, -1, from_m, to_m, wrong_pose(), uniform(-10.0, -6.0), 1.0);
  }

  /// The ground at one place is taken for that at another one by 3 to 8 windows: the same wrong
  /// motion, seen from wherever the vehicle is.
  void add_window_group(Kind kind) {
    const auto count = static_cast<int>(any(3, 8));
    const double span_m = kind == Kind::kOneWindow ? 19.0 : uniform(25.0, 50.0);
    const double every_m = span_m / (count - 1);
    const auto [from_m, to_m] = two_places(span_m + 10.0);
    const SE2 ground = wrong_pose();
    // The two paths run along each other, or against each other; or one old window is found.
    const double way = std::cos(ground.theta()) > 0.0 ? 1.0 : -1.0;
    const double along = kind == Kind::kOneWindow && uniform(0.0, 1.0) < 0.3 ? 0.0 : way;
    const double begin_m = along < 0.0 ? from_m + span_m : from_m;
    for (int i = 0; i < count; ++i) {
      const double a_m = begin_m + along * every_m * i, b_m = to_m + every_m * i;
      const SE2 a_T_b = true_between(begin_m, a_m).inverse() * ground * true_between(to_m, b_m);
      send(kind, groups_, a_m, b_m, a_T_b, uniform(-10.0, -6.0), kAlike);
    }
    ++groups_;
  }

  /// A pass along a plantation: what is found lies some rows beside, or some trees along, all the
  /// way. No right closure comes from there.
  void add_rows() {
    const double length_m = uniform(50.0, 300.0);
    const auto nodes = static_cast<std::size_t>(length_m / kStep_m);
    const std::optional<std::size_t> begin = stretch_driven_before(nodes);
    if (!begin) return;
    const double along = heading_of(*begin, *begin + nodes);
    const double rows_m = sign() * static_cast<double>(any(1, 3)) * uniform(3.0, 6.0);
    const double trees_m = sign() * static_cast<double>(any(1, 3)) * uniform(1.5, 3.0);
    const Eigen::Vector2d local =
        uniform(0.0, 1.0) < 0.5 ? Eigen::Vector2d(0.0, rows_m) : Eigen::Vector2d(trees_m, 0.0);
    const Eigen::Vector2d off = SE2(0.0, 0.0, along) * local;
    const std::size_t count = std::min<std::size_t>(any(3, 8), nodes + 1);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t k = *begin + i * nodes / (count - 1);
      const std::size_t j = *earlier_[k];
      const SE2 elsewhere(drive_.truth[k].translation() + off, drive_.truth[k].theta());
      send(Kind::kRows, groups_, kStep_m * static_cast<double>(j), kStep_m * static_cast<double>(k),
           drive_.truth[j].inverse() * elsewhere, uniform(-10.0, -6.0), 1.0);
    }
    for (std::size_t k = *begin; k <= *begin + nodes; ++k) taken_[k] = true;
    ++groups_;
  }
  double heading_of(std::size_t a, std::size_t b) const {
    const Eigen::Vector2d way = drive_.truth[b].translation() - drive_.truth[a].translation();
    return std::atan2(way.y(), way.x());
  }
  /// So many nodes in a row that were driven before and from which nothing is sent yet.
  std::optional<std::size_t> stretch_driven_before(std::size_t nodes) {
    if (drive_.truth.size() < nodes + 3) return std::nullopt;
    for (int trial = 0; trial < 200; ++trial) {
      const std::size_t begin = any(0, drive_.truth.size() - nodes - 2);
      bool is_free = true;
      for (std::size_t k = begin; k <= begin + nodes; ++k)
        if (!earlier_[k] || taken_[k]) is_free = false;
      if (is_free) return begin;
    }
    return std::nullopt;
  }

  void number_in_order() {
    std::ranges::stable_sort(drive_.sent, {}, [](const SentClosure& one) { return one.to; });
    std::uint64_t id = 0;
    for (SentClosure& one : drive_.sent) one.closure.id = ++id;
  }

  ClosurePlan plan_;
  std::mt19937_64 random_;
  ClosureDrive drive_;
  std::vector<std::optional<std::size_t>> earlier_;
  std::vector<bool> taken_;  ///< In a plantation.
  int groups_ = 0;
};

}  // namespace

const char* name_of(Kind kind) {
  constexpr const char* kNames[kKinds] = {"right", "alone", "one-window", "successive", "rows"};
  return kNames[static_cast<std::size_t>(kind)];
}

ClosureDrive make_closure_drive(const ClosurePlan& plan, std::uint64_t seed) {
  return DriveMaker(plan, seed * 7'919 + 11).make(seed);
}

geometry::SE2WithCovariance between_nodes(const SentClosure& sent) {
  const geometry::SE2WithCovariance from{sent.from_T_end, Eigen::Matrix3d::Zero()};
  const geometry::SE2WithCovariance to{sent.to_T_end, Eigen::Matrix3d::Zero()};
  return compound(compound(from, sent.closure.from_T_to), inverse(to));
}

}  // namespace understory::eval::experiments::closures
