#include "eval/experiments/partition/comparison.hpp"

#include <map>
#include <stdexcept>

#include "eval/tools/memory.hpp"

namespace understory::eval::experiments::partition {
namespace {

Trajectory stamped(const std::vector<model::KeyframePose>& poses) {
  Trajectory result;
  result.reserve(poses.size());
  for (const model::KeyframePose& one : poses) result.push_back({one.utime, one.map_T_vehicle});
  return result;
}

/// Every keyframe is kept, with its motions.
PolicyRun map_uncut(const RecordedDrive& drive,
                    geoslam_mapper::SmoothingMapperParameters parameters) {
  parameters.known_ground_m = 0.0;
  return map_drive(drive, {"uncut", 0.0, 0.0}, parameters);
}

/// A way of the thesis's method.
struct Design {
  const char* method;
  Propagation propagation;
  Condensed condensed;
  Shared shared;
  bool is_full;
};
constexpr auto kCompounding = Propagation::kCompounding;
constexpr Design kDesigns[] = {
    {"baseline", kCompounding, Condensed::kSingly, Shared::kAtCut, false},
    {"baseline-condensed", kCompounding, Condensed::kSingly, Shared::kAtCut, false},
    {"baseline-unscented", Propagation::kUnscented, Condensed::kSingly, Shared::kAtCut, false},
    {"baseline-joint", kCompounding, Condensed::kJointly, Shared::kAtCut, false},
    {"baseline-joint-all", kCompounding, Condensed::kJointly, Shared::kAll, false},
    {"baseline-full", kCompounding, Condensed::kSingly, Shared::kAtCut, true}};

/// Compares on one drive.
class Comparison {
 public:
  Comparison(const RecordedDrive& drive,
             const geoslam_mapper::SmoothingMapperParameters& parameters,
             const ComparisonOptions& options)
      : drive_(drive),
        parameters_(parameters),
        options_(options),
        length_m_(drive.length_m()),
        run_(map_uncut(drive, parameters)) {
    uncut_ = stamped(run_.settled);
    if (uncut_.empty()) throw std::runtime_error("no keyframe of the drive is in a map");
    const auto truth_of = [&](model::Utime utime) {
      return metrics::pose_at(drive_.truth, utime).value_or(geometry::SE2());
    };
    const geometry::SE2 map_T_world =
        uncut_.front().pose * truth_of(uncut_.front().utime).inverse();
    reference_.reserve(uncut_.size());
    for (const metrics::StampedPose& one : uncut_)
      reference_.push_back({one.utime, map_T_world * truth_of(one.utime)});
    landmarks_ = mean_landmarks(run_.graph);
    for (const auto& keyframe : run_.graph.keyframes)
      pose_of_[keyframe.utime] = index(keyframe.pose);
  }

  std::vector<Outcome> all() {
    add("truth", {"truth", 0.0, 0.0}, reference_, {});
    add_mapper({"uncut", 0.0, 0.0}, run_);
    for (const Policy& policy : options_.policies) {
      if (policy.size_m <= options_.largest_m)
        add_mapper(policy, map_drive(drive_, policy, parameters_));
      for (const Design& design : kDesigns) {
        if (options_.all_designs || &design == kDesigns) add_baseline(policy, design);
      }
    }
    return std::move(outcomes_);
  }

 private:
  /// What follows from the trajectory and the cuts alone.
  Outcome& add(const char* method, const Policy& policy, Trajectory trajectory,
               std::vector<model::Utime> cuts) {
    Outcome& out = outcomes_.emplace_back();
    out.method = method;
    out.policy = policy;
    out.length_m = length_m_;
    out.submaps = cuts.size() + 1;
    out.to_uncut = distances(trajectory, uncut_, cuts);
    out.to_reference = distances(trajectory, reference_, cuts);
    out.uncut_to_reference = distances(uncut_, reference_, cuts);
    std::vector<double> landmarks;
    landmarks.reserve(cuts.size());
    for (const model::Utime cut : cuts) {
      const auto found = pose_of_.find(cut);
      landmarks.push_back(found == pose_of_.end() ? 0.0 : landmarks_[found->second]);
    }
    out.effects = effects(trajectory, uncut_, cuts, landmarks);
    out.trajectory = std::move(trajectory);
    out.cuts = std::move(cuts);
    return out;
  }

  void add_mapper(const Policy& policy, const PolicyRun& run) {
    const std::pair<const char*, const std::vector<model::KeyframePose>*> ends[] = {
        {"smoothing-condensed", &run.condensed}, {"smoothing", &run.settled}};
    for (const auto& [method, poses] : ends) {
      Outcome& out = add(method, policy, stamped(*poses), run.cuts);
      out.partition_ms = run.partition_ms;
      out.iteration_ms = run.iteration_ms;
      out.closure_s = poses == &run.settled ? run.settling_s : run.joining_s;
      out.resident_mb = run.resident_mb;
      out.stored_bytes = static_cast<double>(run.stored_bytes);
      out.mean_nees = run.mean_nees;
      out.refused = run.refused;
    }
  }

  void add_baseline(const Policy& policy, const Design& design) {
    BaselineOptions options;
    options.policy = policy.cuts();
    options.propagation = design.propagation;
    options.condensed = design.condensed;
    options.shared = design.shared;
    options.also_full = design.is_full;
    if (options_.is_closed) options.first_T_last = manual_closure();
    BaselineSolution solution;
    try {
      solution = solve_by_submaps(run_.graph, options);
    } catch (const std::runtime_error& error) {
      Outcome& out = outcomes_.emplace_back();
      out.method = design.method;
      out.policy = policy;
      out.failure = error.what();
      return;
    }

    // Without a closure the thesis's submaps are a chain (§5.1).
    const bool is_chain = !options_.is_closed && &design == kDesigns;
    const std::vector<geometry::SE2>& poses = design.is_full ? solution.full
                                              : is_chain     ? solution.chained
                                                             : solution.expanded;
    Outcome& out = add(design.method, policy, trajectory_of(poses), cuts_at(solution.cuts));
    out.partition_ms = solution.partition_ms;
    out.iteration_ms = solution.iteration_ms;
    out.closure_s = solution.closure_s;
    out.resident_mb = tools::resident_mb();
    out.stored_bytes = static_cast<double>(solution.stored_bytes);
  }

  /// Set by hand, from the reference (§3.4.3).
  geometry::SE2 manual_closure() const {
    const auto& first = run_.graph.keyframes.front();
    const auto& last = run_.graph.keyframes.back();
    const geometry::SE2 motion = reference_.front().pose.inverse() * reference_.back().pose;
    return first.pose_T_base * motion * last.pose_T_base.inverse();
  }

  Trajectory trajectory_of(const std::vector<geometry::SE2>& poses) const {
    Trajectory result;
    result.reserve(run_.graph.keyframes.size());
    for (const auto& keyframe : run_.graph.keyframes)
      result.push_back({keyframe.utime, poses[index(keyframe.pose)] * keyframe.pose_T_base});
    return result;
  }

  /// Of the first keyframe that is tied to the pose.
  std::vector<model::Utime> cuts_at(const std::vector<std::size_t>& poses) const {
    std::vector<model::Utime> cuts;
    for (const std::size_t pose : poses) {
      for (const auto& keyframe : run_.graph.keyframes) {
        if (index(keyframe.pose) != pose) continue;
        cuts.push_back(keyframe.utime);
        break;
      }
    }
    return cuts;
  }

  const RecordedDrive& drive_;
  const geoslam_mapper::SmoothingMapperParameters& parameters_;
  const ComparisonOptions& options_;
  double length_m_;
  PolicyRun run_;  ///< Uncut.
  Trajectory uncut_;
  Trajectory reference_;           ///< The truth, in the frame of the first keyframe.
  std::vector<double> landmarks_;  ///< By pose of the uncut drive.
  std::map<model::Utime, std::size_t> pose_of_;
  std::vector<Outcome> outcomes_;
};

}  // namespace

std::vector<Outcome> compare(const RecordedDrive& drive,
                             const geoslam_mapper::SmoothingMapperParameters& parameters,
                             const ComparisonOptions& options) {
  return Comparison(drive, parameters, options).all();
}

}  // namespace understory::eval::experiments::partition
