// The interface of all loop detectors: finds frames that may show the place of a query.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/detector_parameters.hpp"
#include "common/place_recognition/place_frame.hpp"

namespace understory::place_recognition {

/// Evidence of a place from a detector with a probability as score; the caller can compare it with
/// chance.
struct PlaceEvidence {
  /// Natural logarithm of the likelihood ratio against uniformly distributed landmarks.
  double log_ratio = 0.0;
  std::size_t pairs = 0;  ///< Landmarks of the query that are in the frame.
  /// For the answer: decades between the likeliest frame and the likeliest one at another place.
  double margin_decades = 0.0;
};

/// A frame that may show the place of a query.
struct ScoredPlace {
  FrameId frame = 0;
  /// A higher score means more similar; finite. Scores of two detectors are not comparable.
  double score = 0.0;
  /// Possible poses of the query in the frame: none where the detector gives no pose, several where
  /// it is ambiguous (a heading modulo pi). Undetermined components have a wide covariance (tangent
  /// order, right perturbation, m and rad).
  std::vector<geometry::SE2WithCovariance> guesses;
  /// None for detectors whose score is not a probability.
  std::optional<PlaceEvidence> evidence = std::nullopt;
};

/// Options of a query.
struct PlaceQuery {
  FrameId newest = std::numeric_limits<FrameId>::max();  ///< Frames of ids up to this.
  std::size_t most = 10;  ///< Largest number of places, the most similar ones.
};

/// A database of frames that finds similar ones (thesis 002 §2.4.1). Deterministic: the same frames
/// in the same order give the same answer, independent of earlier queries.
class PlaceDetector {
 public:
  PlaceDetector() = default;
  virtual ~PlaceDetector() = default;
  PlaceDetector(const PlaceDetector&) = delete;
  PlaceDetector& operator=(const PlaceDetector&) = delete;

  /// Adds a frame. Precondition: its id is larger than all earlier ones.
  virtual void add(const PlaceFrame& frame) = 0;

  /// The frames most similar to this one, the best first, ties by id. Empty where the frame has too
  /// little content (no landmark, nothing finite).
  virtual std::vector<ScoredPlace> query(const PlaceFrame& frame,
                                         const PlaceQuery& limits) const = 0;

  /// Number of frames.
  virtual std::size_t size() const = 0;
  /// Size of the descriptors of all frames [bytes].
  virtual std::size_t descriptor_bytes() const = 0;
};

/// The detectors' names for a configuration, in the order of the decision's table.
std::vector<std::string> detector_names();

/// A detector without frames. Throws std::invalid_argument with `name` and the allowed names.
std::unique_ptr<PlaceDetector> make_detector(std::string_view name,
                                             const DetectorParameters& parameters = {});

/// Whether the detector compares clouds of points (for a frame without one, its landmarks as
/// points). Throws likewise.
bool wants_cloud(std::string_view detector);
/// Whether the detector's places have PlaceEvidence. Throws likewise.
bool gives_evidence(std::string_view detector);

}  // namespace understory::place_recognition
