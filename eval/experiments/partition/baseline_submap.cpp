#include "eval/experiments/partition/baseline_submap.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

#include "common/factor_graph/plane/archive.hpp"
#include "common/factor_graph/plane/optimise.hpp"
#include "common/factor_graph/plane/smoother.hpp"
#include "common/state/archive.hpp"
#include "eval/tools/thread_clock.hpp"

namespace understory::eval::experiments::partition {
namespace {

namespace plane = factor_graph::plane;

/// Information of what is held [1/m^2, 1/rad^2].
constexpr double kSharedHeld = 1e10;

plane::PoseId pose_id(std::size_t i) { return plane::PoseId(static_cast<std::uint32_t>(i)); }
plane::PointId point_id(std::size_t i) { return plane::PointId(static_cast<std::uint32_t>(i)); }

[[noreturn]] void fail_submap(const BaselineSubmap& submap, const std::string& why) {
  throw std::runtime_error(
      fmt::format("submap of poses {} to {}: {}", submap.first, submap.last, why));
}

/// By pose, the landmarks that it observed.
using Observed = std::map<std::size_t, std::set<plane::PointId>>;

Observed observed_near(const DriveGraph& drive, const std::vector<std::size_t>& cuts) {
  Observed observed;
  for (const std::size_t cut : cuts) observed[cut], observed[cut + 1];
  for (const plane::PointObservation& one : drive.graph.observations) {
    const auto found = observed.find(index(one.pose));
    if (found != observed.end()) found->second.insert(one.point);
  }
  return observed;
}

/// Takes the factors of a drive into submaps.
class SubmapCutter {
 public:
  SubmapCutter(const DriveGraph& drive, const std::vector<std::size_t>& cuts) : drive_(drive) {
    std::size_t first = 0;
    for (const std::size_t cut : cuts) first = begin(first, cut);
    begin(first, drive.graph.poses.size() - 1);
    own_.resize(submaps_.size());
  }

  std::vector<BaselineSubmap> take(const std::vector<std::size_t>& cuts, Shared shared) {
    for (const plane::PointObservation& one : drive_.graph.observations) add(one);
    for (const plane::RelativePose& one : drive_.graph.relative_poses) add(one);
    // As known when the drive was over.
    for (const plane::BiasedRelativePose& one : drive_.graph.biased_relative_poses) {
      plane::RelativePose motion = one.motion;
      motion.a_T_b = plane::at_true_rate(motion.a_T_b, drive_.graph[one.bias], one.seconds);
      add(motion);
    }
    if (shared == Shared::kAll) {
      share_all();
    } else {
      share(cuts);
    }
    return std::move(submaps_);
  }

 private:
  std::size_t begin(std::size_t first, std::size_t last) {
    BaselineSubmap& submap = submaps_.emplace_back();
    submap.first = first;
    submap.last = last;
    if (last < first + 2) fail_submap(submap, "less than three poses");
    for (std::size_t i = first; i <= last; ++i) submap.graph.add_pose(drive_.graph.poses[i]);
    submap.graph.pose_priors.push_back(
        {pose_id(0), drive_.graph.poses[first], kSharedHeld * Eigen::Matrix3d::Identity()});
    return last;
  }
  /// That in which the pose is not the first one; pose 0 is of the first submap.
  std::size_t submap_of(std::size_t pose) const {
    const auto found = std::find_if(submaps_.begin(), submaps_.end(),
                                    [&](const BaselineSubmap& one) { return pose <= one.last; });
    return static_cast<std::size_t>(found - submaps_.begin());
  }
  void add(plane::PointObservation one) {
    const std::size_t number = submap_of(index(one.pose));
    BaselineSubmap& submap = submaps_[number];
    const auto [entry, is_new] = own_[number].try_emplace(one.point, submap.points.size());
    if (is_new) {
      submap.points.push_back(one.point);
      submap.graph.add_point(drive_.graph[one.point]);
    }
    one.pose = pose_id(index(one.pose) - submap.first);
    one.point = point_id(entry->second);
    submap.graph.observations.push_back(one);
  }
  /// Motions across a cut pose there are none: each pose has one to the next.
  void add(plane::RelativePose one) {
    BaselineSubmap& submap = submaps_[submap_of(std::max(index(one.a), index(one.b)))];
    if (std::min(index(one.a), index(one.b)) < submap.first) return;
    one.a = pose_id(index(one.a) - submap.first);
    one.b = pose_id(index(one.b) - submap.first);
    submap.graph.relative_poses.push_back(one);
  }
  void share(const std::vector<std::size_t>& cuts) {
    const Observed observed = observed_near(drive_, cuts);
    for (std::size_t i = 0; i < cuts.size(); ++i) {
      for (const plane::PointId point : observed.at(cuts[i])) {
        if (!observed.at(cuts[i] + 1).contains(point)) continue;
        for (const std::size_t submap : {i, i + 1}) {
          const std::size_t own = own_[submap].at(point);
          std::vector<std::size_t>& shared = submaps_[submap].shared_points;
          if (std::find(shared.begin(), shared.end(), own) == shared.end()) shared.push_back(own);
        }
      }
    }
  }

  void share_all() {
    std::map<plane::PointId, int> submaps;
    for (const auto& own : own_)
      for (const auto& [point, number] : own) ++submaps[point];
    for (std::size_t i = 0; i < submaps_.size(); ++i) {
      for (const auto& [point, number] : own_[i])
        if (submaps.at(point) > 1) submaps_[i].shared_points.push_back(number);
    }
  }

  const DriveGraph& drive_;
  std::vector<BaselineSubmap> submaps_;
  std::vector<std::map<plane::PointId, std::size_t>> own_;  ///< By submap: own number of a point.
};

/// The covariance of (x, y, phi) of poses and (x, y) of points, from that of right perturbations.
Eigen::MatrixXd of_numbers(const Eigen::MatrixXd& joint, const std::vector<geometry::SE2>& poses) {
  Eigen::MatrixXd turn = Eigen::MatrixXd::Identity(joint.rows(), joint.cols());
  for (std::size_t i = 0; i < poses.size(); ++i)
    turn.block<2, 2>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * i)) =
        poses[i].rotation();
  return turn * joint * turn.transpose();
}

}  // namespace

std::vector<BaselineSubmap> submaps_of(const DriveGraph& drive,
                                       const std::vector<std::size_t>& cuts, Shared shared) {
  return SubmapCutter(drive, cuts).take(cuts, shared);
}

void optimise(BaselineSubmap& submap) {
  const factor_graph::batch::BatchReport report = plane::optimise(submap.graph);
  if (!report.ok) fail_submap(submap, report.error);
}

Relations condense(const BaselineSubmap& submap, Propagation propagation) {
  plane::Smoother smoother;
  smoother.start_from(submap.graph);
  if (const auto update = smoother.update(); !update.ok) fail_submap(submap, update.error);

  const std::vector<plane::PoseId> poses{pose_id(submap.origin()), pose_id(0),
                                         pose_id(submap.last - submap.first)};
  std::vector<plane::PointId> points;
  points.reserve(submap.shared_points.size());
  for (const std::size_t own : submap.shared_points) points.push_back(point_id(own));
  const auto joint = smoother.joint_marginal(poses, points);
  if (!joint) fail_submap(submap, "what it shares is not determined");

  std::vector<geometry::SE2> estimates;
  estimates.reserve(poses.size());
  std::vector<Eigen::Vector3d> numbers;
  numbers.reserve(poses.size());
  for (const plane::PoseId id : poses) {
    estimates.push_back(submap.graph[id]);
    numbers.push_back(submap.graph[id].coordinates());
  }
  std::vector<Eigen::Vector2d> positions;
  positions.reserve(points.size());
  for (const plane::PointId id : points) positions.push_back(submap.graph[id]);
  return relations(numbers[0], {numbers[1], numbers[2]}, positions, of_numbers(*joint, estimates),
                   propagation);
}

std::vector<geometry::SE2> expand(const BaselineSubmap& submap, const geometry::SE2& entrance,
                                  const geometry::SE2& exit,
                                  const std::vector<Eigen::Vector2d>& shared_m) {
  plane::Graph graph = submap.graph;
  const geometry::SE2 map_T_submap = entrance * graph.poses.front().inverse();
  for (geometry::SE2& pose : graph.poses) pose = map_T_submap * pose;
  for (Eigen::Vector2d& point : graph.points) point = map_T_submap * point;

  const Eigen::Matrix3d held = kSharedHeld * Eigen::Matrix3d::Identity();
  graph.pose_priors = {{pose_id(0), entrance, held},
                       {pose_id(submap.last - submap.first), exit, held}};
  for (std::size_t i = 0; i < submap.shared_points.size(); ++i) {
    graph.point_priors.push_back({point_id(submap.shared_points[i]), shared_m[i],
                                  kSharedHeld * Eigen::Matrix2d::Identity()});
  }
  if (const auto report = plane::optimise(graph); !report.ok) fail_submap(submap, report.error);
  return graph.poses;
}

double iteration_ms(const BaselineSubmap& submap) {
  std::vector<std::vector<const plane::PointObservation*>> observations(submap.graph.poses.size());
  for (const plane::PointObservation& one : submap.graph.observations)
    observations[index(one.pose)].push_back(&one);
  std::vector<std::vector<const plane::RelativePose*>> motions(submap.graph.poses.size());
  for (const plane::RelativePose& one : submap.graph.relative_poses)
    motions[std::max(index(one.a), index(one.b))].push_back(&one);

  plane::Smoother smoother;
  std::map<plane::PointId, plane::PointId> points;
  double seconds = 0.0;
  for (std::size_t i = 0; i < submap.graph.poses.size(); ++i) {
    const double begin_s = tools::thread_time_s();
    smoother.add_pose(submap.graph.poses[i]);
    if (i == 0) smoother.add(submap.graph.pose_priors.front());
    for (const plane::PointObservation* one : observations[i]) {
      const auto [entry, is_new] = points.try_emplace(one->point);
      if (is_new) entry->second = smoother.add_point(submap.graph[one->point]);
      plane::PointObservation factor = *one;
      factor.point = entry->second;
      smoother.add(factor);
    }
    for (const plane::RelativePose* one : motions[i]) smoother.add(*one);
    (void)smoother.update();  // A pose without motion may be undetermined until the next one.
    seconds += tools::thread_time_s() - begin_s;
  }
  return 1e3 * seconds / static_cast<double>(submap.graph.poses.size());
}

std::size_t stored_bytes(const BaselineSubmap& submap) {
  constexpr state::Format kFormat{"partition.baseline.submap", 1};
  return state::save(kFormat, submap.graph).size();
}

}  // namespace understory::eval::experiments::partition
