// Queries asked of detectors, their candidates compared by verifiers, and how answers are scored.
#pragma once

#include <atomic>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "common/place_recognition/place_detector.hpp"
#include "common/place_recognition/place_verifier.hpp"
#include "eval/experiments/loop_detectors/frame_set.hpp"

namespace understory::eval::experiments::loop_detectors {

/// What counts as a revisit, and what is asked.
struct TrialOptions {
  double radius_m = 5.0;
  std::size_t frames_earlier = 50;      ///< At least so many.
  std::size_t most_queries = 400;       ///< Of a set, spread evenly over it.
  std::size_t most_cloud_queries = 80;  ///< Of a set with clouds, which cost a hundred times more.
  std::size_t candidates = 3;  ///< That a verifier compares; the best by its score is taken.
  double pose_m = 1.0;         ///< A pose of a right answer that is farther off is wrong ...
  double pose_rad = 0.1;       ///< ... or turned by more.
  int jobs = 1;
};

/// One query and its answer.
struct Answer {
  bool has_match = false;  ///< A frame that may be answered was taken within the radius.
  bool has_answer = false;
  bool is_right = false;  ///< The frame answered was taken within the radius.
  bool has_pose = false;  ///< The relative pose is off by less than the bounds.
  double score = 0.0;     ///< Of the detector, or of the verifier.
  double error_m = 0.0;   ///< Of the relative pose, where the answer is right.
  double ms = 0.0;        ///< Processor time of the query and of all comparisons.
};

/// All answers of one detector, alone or with one verifier, in one set.
struct Answers {
  std::string detector;
  std::string verifier = "none";
  std::vector<Answer> answers;
  double bytes_per_frame = 0.0;
};

/// The queries of a set: indices of frames, ascending, that have frames to be answered.
std::vector<std::size_t> queries_of(const FrameSet& set, const TrialOptions& options);

/// Every detector alone and with every verifier, on the same queries. All frames are in the
/// database; those from `frames_earlier` before the query on are not answered. Throws
/// terminal::Interrupted when `stop` turns true.
std::vector<Answers> run_trials(const FrameSet& set, const std::vector<std::string>& detectors,
                                const std::vector<std::string>& verifiers,
                                const TrialOptions& options, const std::atomic<bool>& stop);

/// Precision and recall of some answers.
struct DetectorScore {
  std::size_t queries = 0;                ///< That have a match.
  std::size_t queries_without_match = 0;  ///< All others.
  double recall_at_1 = 0.0;
  double max_f1 = 0.0;
  double recall_zero_wrong = 0.0;  ///< At the lowest threshold without a wrong answer.
  double recall_accepted = 0.0;    ///< Right and above the threshold, of the queries with a match.
  std::size_t wrong_accepted = 0;  ///< Above the threshold and beyond the radius, of all queries.
  std::size_t wrong_poses_accepted = 0;          ///< Above it, a right frame and a wrong pose.
  std::vector<std::pair<double, double>> curve;  ///< Recall and precision, by falling threshold.
};
/// An answer is accepted above `threshold`. Recall is over the queries with a match.
DetectorScore score_of(const std::vector<Answer>& answers, double threshold);

/// The least threshold that accepts no wrong answer; minus infinity where there is none.
double highest_wrong_score(const std::vector<Answer>& answers);

}  // namespace understory::eval::experiments::loop_detectors
