// Place recognition by stems: finds the added frame taken at the place of a query.
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

/// Limits and effort of the search.
struct StemRecogniserParameters {
  StemNoise noise;
  StemTriangleParameters triangles;
  StemChainParameters chains;
  /// Largest difference between sides of one triangle in two frames.
  double side_tolerance_m = 0.25;
  /// Largest difference between the logarithms of a corner's diameters.
  double diameter_log_tolerance = 0.7;
  double max_distance_m = 12.0;   ///< Frames taken farther away are not searched.
  double radius_m = 5.0;          ///< A frame taken within this distance is at the query's place.
  std::size_t most_frames = 500;  ///< Number of frames whose own stems are compared with the query.
  std::size_t most_views = 40;    ///< Number of these whose views are also compared.
  double gate_m = 0.4;            ///< Largest distance of a reported pair of stems.
};

/// A frame that may show the place of the query.
struct PlaceCandidate {
  FrameId frame = 0;
  geometry::SE2 frame_T_query;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Tangent order, right perturbation.
  double log_ratio = 0.0;  ///< Natural logarithm of the likelihood ratio against random stems.
  /// log10 of a bound on the expected number of poses, over all frames, that explain the query
  /// equally well by chance.
  double log10_false_alarm = 0.0;
  std::uint32_t votes = 0;  ///< Number of triangles for the pose.
  std::vector<StemPair> pairs;
};

/// Result of a query.
struct PlaceAnswer {
  /// The likeliest first.
  std::vector<PlaceCandidate> candidates;
  /// Index of the candidate taken nearest to the query's place, among those that agree with the
  /// likeliest one on this place; if all may be chance, the likeliest one within the radius.
  std::size_t nearest = 0;
  /// Decades between the likeliest and the likeliest disagreeing candidate; below zero if a less
  /// likely one is the answer.
  double log10_margin = 0.0;

  /// The answer; none without candidates.
  const PlaceCandidate* best() const { return candidates.empty() ? nullptr : &candidates[nearest]; }
};

/// A database of frames. Triangles of stems find frames and poses; the likelihood of all stems and
/// their diameters decides.
class StemRecogniser {
 public:
  /// An empty database.
  explicit StemRecogniser(const StemRecogniserParameters& parameters = {});
  ~StemRecogniser();
  StemRecogniser(StemRecogniser&&) noexcept;
  StemRecogniser& operator=(StemRecogniser&&) noexcept;

  /// Adds a frame. Precondition: its id is larger than all earlier ones.
  void add(FrameId id, std::span<const LevelStem> stems);

  /// Frames of ids up to `newest` that may show the place of these stems.
  PlaceAnswer query(std::span<const LevelStem> stems,
                    FrameId newest = std::numeric_limits<FrameId>::max()) const;

  /// Number of frames.
  std::size_t size() const;
  /// Size of the stored data of all frames [bytes]; the index is built from it.
  std::size_t stored_bytes() const;

 private:
  class Index;
  std::unique_ptr<Index> index_;
};

}  // namespace understory::place_recognition
