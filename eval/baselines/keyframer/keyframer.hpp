// The thesis's local bundle adjustment (GeoSLAM §4.2, algorithm 2), as its published code does it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/model/keyframe.hpp"
#include "common/model/landmarks.hpp"
#include "eval/baselines/keyframer/observation.hpp"
#include "eval/baselines/keyframer/parameters.hpp"

namespace understory::eval::baselines::keyframer {

/// Its keyframes are in the frame of their base scan: `centre` is the base, whose covariance is
/// zero, and every landmark has the thesis's information of 100 I [1/m^2]. It uses landmarks alone.
class Keyframer {
 public:
  /// Starts without any scan.
  explicit Keyframer(const Parameters& parameters);

  /// Takes one scan, in order of time. Returns the keyframe that the scan completes, if any.
  std::optional<model::Keyframe> add(const model::LandmarkScan& scan);

  /// Scans so far.
  std::uint64_t scans() const { return scans_; }
  /// Scans that are in no keyframe: too few landmarks, or no other scan matched them in time.
  std::uint64_t scans_unmatched() const { return scans_unmatched_; }
  /// Keyframes that were given out.
  std::uint64_t keyframes() const { return keyframes_; }

 private:
  void link_to_members(Observation scan);
  void start_keyframe(Observation scan);
  void insert_member(Observation member);
  bool is_due(std::uint64_t number) const;
  void drop_stale(std::uint64_t number);
  model::Keyframe publish();
  std::vector<model::KeyframeLandmark> centroids() const;

  Parameters parameters_;
  AlignmentParameters alignment_;
  std::vector<Observation> waiting_;  ///< [otherObsv] Not matched yet, oldest first.
  std::vector<Observation> members_;  ///< [kfObsv] Of the keyframe in progress, oldest first.
  std::uint64_t scans_ = 0;
  std::uint64_t scans_unmatched_ = 0;
  std::uint64_t keyframes_ = 0;
};

}  // namespace understory::eval::baselines::keyframer
