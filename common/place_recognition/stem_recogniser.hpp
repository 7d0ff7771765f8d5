// Which frame of stems was taken where this one was, among all that were added.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/level_stems.hpp"
#include "common/place_recognition/place_frame.hpp"
#include "common/place_recognition/stem_chains.hpp"
#include "common/place_recognition/stem_likelihood.hpp"
#include "common/place_recognition/stem_triangles.hpp"

namespace understory::place_recognition {

/// What is looked for, and how hard.
struct StemRecogniserParameters {
  StemNoise noise;
  StemTriangleParameters triangles;
  StemChainParameters chains;
  double side_tolerance_m = 0.25;       ///< Between sides of one triangle in two frames.
  double diameter_log_tolerance = 0.7;  ///< Between the logarithms of a corner's diameters.
  double max_distance_m = 12.0;         ///< Frames taken farther away are not looked for.
  double radius_m = 5.0;          ///< A frame taken within this is the place that is asked for.
  std::size_t most_frames = 500;  ///< Whose own stems are compared with the query.
  std::size_t most_views = 40;    ///< Of these, whose surroundings are compared as well.
  double gate_m = 0.4;            ///< Pairs of stems that are told are nearer.
};

/// A frame that may show the place of the query.
struct PlaceCandidate {
  FrameId frame = 0;
  geometry::SE2 frame_T_query;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Tangent order, right perturbation.
  double log_ratio = 0.0;  ///< Log likelihood (natural) over that of stems that lie anywhere.
  /// log10 of a bound on the expected number of poses, of all poses of all frames, that explain
  /// the query as well by chance.
  double log10_false_alarm = 0.0;
  std::uint32_t votes = 0;  ///< Triangles that led to the pose.
  std::vector<StemPair> pairs;
};

/// What a query gives.
struct PlaceAnswer {
  /// The likeliest first.
  std::vector<PlaceCandidate> candidates;
  /// Index of the candidate that was taken nearest to where the query was, of those that agree with
  /// the likeliest on where that is; where chance may be behind all of them, of the likeliest
  /// within the radius.
  std::size_t nearest = 0;
  /// Decades between the likeliest and the likeliest of those that do not agree with it; below zero
  /// where a less likely one is answered.
  double log10_margin = 0.0;

  /// The answer; none where there is no candidate.
  const PlaceCandidate* best() const { return candidates.empty() ? nullptr : &candidates[nearest]; }
};

/// A database of frames. Triangles of stems find frames and poses; the likelihood of all stems, of
/// their diameters as well, decides.
class StemRecogniser {
 public:
  /// Without frames.
  explicit StemRecogniser(const StemRecogniserParameters& parameters = {});
  ~StemRecogniser();
  StemRecogniser(StemRecogniser&&) noexcept;
  StemRecogniser& operator=(StemRecogniser&&) noexcept;

  /// Adds a frame. Precondition: its id is larger than those before.
  void add(FrameId id, std::span<const LevelStem> stems);

  /// Frames of ids up to `newest` that may show the place of these stems.
  PlaceAnswer query(std::span<const LevelStem> stems,
                    FrameId newest = std::numeric_limits<FrameId>::max()) const;

  /// Number of frames.
  std::size_t size() const;
  /// What has to be kept of all frames [bytes]: the index follows from it.
  std::size_t stored_bytes() const;

 private:
  class Index;
  std::unique_ptr<Index> index_;
};

}  // namespace understory::place_recognition
