// Scan Context: the greatest heights around a sensor, in rings and sectors.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/detector_parameters.hpp"
#include "common/place_recognition/place_detector.hpp"

namespace understory::place_recognition::detectors {

/// Stored data of a frame.
struct ScanContext {
  /// Heights by sector, then by ring; each sector has norm 1 or is all zero.
  std::vector<float> columns;
  std::vector<float> ring_key;  ///< Share of sectors with a point, for each ring.
};

/// The smallest distance of two contexts and its shift.
struct ContextDistance {
  double distance = 1.0;  ///< 0 = equal, 1 = entirely different.
  std::size_t shift = 0;  ///< Sectors from the query's to the frame's.
};

/// Kim & Kim 2018 (thesis 002 §2.4.1). The value of a bin is the greatest height in it above the
/// ground (height + lift_m; points below count as 0, as empty bins do). For a frame without a
/// cloud, the landmarks are points of height z.
class ScanContextMaker {
 public:
  /// Precondition: at least one ring and one sector, a range > 0.
  explicit ScanContextMaker(const ScanContextParameters& parameters) : parameters_(parameters) {}

  /// Context of points (frame `vehicle_level`) relative to `origin_m`. None without a point in
  /// range.
  std::optional<ScanContext> describe(std::span<const Eigen::Vector3f> points,
                                      const Eigen::Vector2d& origin_m) const;

  /// Eqs. 2.31 and 2.32: the mean of 1 - cosine over the sectors, least under all shifts. A sector
  /// empty in both is not counted; one empty in one of them counts as 1. O(rings * sectors^2).
  ContextDistance distance(const ScanContext& query, const ScanContext& frame) const;

  /// Euclidean distance of the ring keys (eq. 2.30 as in the paper, which counts occupied sectors).
  double key_distance(std::span<const float> a, std::span<const float> b) const;

  /// The heading [rad] of the query in the frame by a shift.
  double heading_rad(std::size_t shift) const;
  /// Standard deviation of a heading [rad] for a query `place_sigma_m` beside the frame: from a
  /// sector's width, and from the displacement of points at half of the range.
  double heading_sigma_rad(double place_sigma_m) const;
  /// The parameters given to the constructor.
  const ScanContextParameters& parameters() const { return parameters_; }

 private:
  ScanContextParameters parameters_;
};

/// A query's context from its own position or from one shifted sideways (root shifting).
struct ShiftedContext {
  ScanContext context;
  double left_m = 0.0;  ///< Shift of the viewpoint to the left.
};
/// All contexts of a query; empty where it has no point in range.
std::vector<ShiftedContext> shifted_contexts(const ScanContextMaker& maker,
                                             const PlaceFrame& frame);

/// The least distance of any of the query's contexts to a frame's, and the implied pose.
struct BestContext {
  double distance = 1.0;
  geometry::SE2 frame_T_query;
};
/// Precondition: `query` is not empty.
BestContext best_context(const ScanContextMaker& maker, std::span<const ShiftedContext> query,
                         const ScanContext& frame);

/// A context in packed form, for 25,000 places: values in steps of a 255th of their sector's norm,
/// which changes a distance by less than 0.003.
struct PackedContext {
  std::vector<std::uint8_t> columns;
  std::vector<float> ring_key;
};
/// Packs, rounded to the nearest step.
PackedContext packed(const ScanContext& context);
/// Unpacks.
ScanContext unpacked(const PackedContext& context);

/// Frames of the nearest ring keys, compared in full. The score is minus the distance.
class ScanContextDetector final : public PlaceDetector {
 public:
  /// `place_sigma_m`: sigma of a query's position around a similar frame.
  ScanContextDetector(const ScanContextParameters& parameters, double place_sigma_m);

  void add(const PlaceFrame& frame) override;
  std::vector<ScoredPlace> query(const PlaceFrame& frame, const PlaceQuery& limits) const override;
  std::size_t size() const override { return ids_.size(); }
  std::size_t descriptor_bytes() const override;

 private:
  std::vector<std::size_t> nearest_keys(std::span<const ShiftedContext> query,
                                        std::size_t end) const;

  ScanContextMaker maker_;
  double place_sigma_m_;
  std::vector<FrameId> ids_;
  std::vector<std::optional<PackedContext>> contexts_;
};

}  // namespace understory::place_recognition::detectors
