// The one interface of all loop detectors: which frames may show the place of this one.
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

/// What a detector knows of a place whose score is a probability: whoever asks may set it against
/// all that chance has.
struct PlaceEvidence {
  double log_ratio = 0.0;  ///< Log likelihood (natural) over that of landmarks that lie anywhere.
  std::size_t pairs = 0;   ///< Landmarks of the query that the frame has.
  /// Of the answer: decades between the likeliest frame and the likeliest of those that put the
  /// query elsewhere.
  double margin_decades = 0.0;
};

/// A frame that may show the place of a query.
struct ScoredPlace {
  FrameId frame = 0;
  /// The higher, the more alike; finite. Scores of two detectors cannot be compared.
  double score = 0.0;
  /// Where the query may lie in the frame: none where the detector says nothing of it, several
  /// where it leaves them open (a heading modulo pi). What a detector does not know has a wide
  /// covariance (tangent order, right perturbation, m and rad).
  std::vector<geometry::SE2WithCovariance> guesses;
  /// None of detectors whose score is no probability.
  std::optional<PlaceEvidence> evidence = std::nullopt;
};

/// Which frames are asked for.
struct PlaceQuery {
  FrameId newest = std::numeric_limits<FrameId>::max();  ///< Frames of ids up to this.
  std::size_t most = 10;                                 ///< So many, the most alike.
};

/// A database of frames that finds those alike (thesis 002 §2.4.1). Values in, values out: the same
/// frames in the same order give the same answer, whatever was asked in between.
class PlaceDetector {
 public:
  PlaceDetector() = default;
  virtual ~PlaceDetector() = default;
  PlaceDetector(const PlaceDetector&) = delete;
  PlaceDetector& operator=(const PlaceDetector&) = delete;

  /// Adds a frame. Precondition: its id is larger than those before.
  virtual void add(const PlaceFrame& frame) = 0;

  /// The frames most like this one, the best first, ties by id. None where the frame says too
  /// little (no landmark, nothing finite).
  virtual std::vector<ScoredPlace> query(const PlaceFrame& frame,
                                         const PlaceQuery& limits) const = 0;

  /// Number of frames.
  virtual std::size_t size() const = 0;
  /// What is kept of all frames to be compared with others [bytes].
  virtual std::size_t descriptor_bytes() const = 0;
};

/// The detectors' names, as a configuration gives them, in the order of the decision's table.
std::vector<std::string> detector_names();

/// A detector without frames. Throws std::invalid_argument that names `name` and those allowed.
std::unique_ptr<PlaceDetector> make_detector(std::string_view name,
                                             const DetectorParameters& parameters = {});

/// Whether the detector compares clouds of points (of a frame without one, its landmarks as
/// points). Throws likewise.
bool wants_cloud(std::string_view detector);
/// Whether the detector's places come with PlaceEvidence. Throws likewise.
bool gives_evidence(std::string_view detector);

}  // namespace understory::place_recognition
