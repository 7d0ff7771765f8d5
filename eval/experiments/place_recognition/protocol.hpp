// The protocols in use for place recognition among stems, and how answers are scored.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/stem_frame.hpp"
#include "common/place_recognition/stem_recogniser.hpp"

namespace understory::eval::experiments::place_recognition {

/// A drive, levelled.
struct StemDrive {
  std::string name;
  std::vector<double> time_s;
  std::vector<geometry::SE2> world_T_level;  ///< The truth.
  std::vector<std::vector<understory::place_recognition::LevelStem>> stems;
};
/// Levels the frames of a drive.
StemDrive levelled(std::string name, const std::vector<model::StemFrame>& frames);

/// Every frame with what the frames before it saw around it, aligned by their stems alone: a short
/// window instead of a single frame.
StemDrive windowed(const StemDrive& drive, std::size_t frames,
                   const understory::place_recognition::StemRecogniserParameters& parameters);

/// What counts as a revisit.
struct Protocol {
  double radius_m = 5.0;
  std::size_t frames_earlier = 50;  ///< Within a drive, at least so many.
  double seconds_earlier = 0.0;     ///< And at least so long.
};

/// One query and its answer.
struct Trial {
  bool has_match = false;  ///< A frame that may be answered was taken within the radius.
  bool has_answer = false;
  bool is_right = false;           ///< The frame answered was taken within the radius.
  bool is_accepted = false;        ///< By the recogniser, which knows no truth.
  double confidence = 0.0;         ///< Decades.
  double error_m = 0.0;            ///< Of the relative pose, where the answer is right.
  std::vector<double> residual_m;  ///< Of matched stems, likewise.
  double ms = 0.0;
};

/// All queries of one protocol.
struct Trials {
  std::vector<Trial> trials;
  double stored_bytes_per_frame = 0.0;
};

/// An answer counts where it is likelier than this many decades not to be one of chance, not to be
/// another place, and to lie within the radius.
inline constexpr double kAcceptDecades = 3.0;

/// -log10 of about the probability that an answer is wrong: chance, another place, or farther from
/// the query than the radius.
double confidence_of(const understory::place_recognition::PlaceAnswer& answer, double radius_m);

/// Every frame of a drive against those earlier that the protocol allows. Throws
/// terminal::Interrupted when `stop` turns true.
Trials within_drive(const StemDrive& drive, const Protocol& protocol,
                    const understory::place_recognition::StemRecogniserParameters& parameters,
                    int jobs, const std::atomic<bool>& stop);

/// Every frame of `queries` against all of `map`; of the protocol the radius counts. Likewise.
Trials between_drives(const StemDrive& queries, const StemDrive& map, const Protocol& protocol,
                      const understory::place_recognition::StemRecogniserParameters& parameters,
                      int jobs, const std::atomic<bool>& stop);

/// Scores over all trials.
struct PlaceScore {
  std::size_t queries = 0;                ///< That have a match.
  std::size_t queries_without_match = 0;  ///< All others.
  double recall_at_1 = 0.0;
  double max_f1 = 0.0;
  double recall_zero_wrong = 0.0;
  double recall_accepted = 0.0;             ///< Right and accepted, of the queries with a match.
  std::size_t wrong_accepted = 0;           ///< Of all queries.
  std::size_t wrong_accepted_no_match = 0;  ///< Of the queries without match.
};
/// Recall is over the queries with a match; a wrong answer is one beyond the radius, whether there
/// is a match or not.
PlaceScore score_of(const std::vector<Trial>& trials);

}  // namespace understory::eval::experiments::place_recognition
