#include "eval/experiments/loop_detectors/detector_trials.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "eval/tools/parallel.hpp"
#include "eval/tools/thread_clock.hpp"

namespace understory::eval::experiments::loop_detectors {
namespace {

namespace places = understory::place_recognition;

/// Thresholds of a curve that are kept, at most about so many.
constexpr std::size_t kCurvePoints = 60;

/// A frame farther away than the radius is not asked for; what truths leave open of it [m].
constexpr double kTruthSigmaM = 0.25;

places::DetectorParameters detector_parameters(const TrialOptions& options) {
  places::DetectorParameters parameters;
  parameters.hierarchy.max_distance_m = options.radius_m - kTruthSigmaM;
  parameters.constellation.max_distance_m = options.radius_m - kTruthSigmaM;
  parameters.stems.radius_m = options.radius_m;
  return parameters;
}

places::VerifierParameters verifier_parameters(const TrialOptions& options) {
  places::VerifierParameters parameters;
  parameters.max_distance_m = options.radius_m - kTruthSigmaM;
  return parameters;
}

/// One set with its queries.
class Trials {
 public:
  Trials(const FrameSet& set, const TrialOptions& options, const std::atomic<bool>& stop)
      : set_(set), options_(options), stop_(stop), queries_(queries_of(set, options)) {}

  /// The detector alone first, then with each verifier.
  void add(const std::string& name, const std::vector<std::string>& verifiers,
           std::vector<Answers>& results) {
    const auto detector = places::make_detector(name, detector_parameters(options_));
    for (const places::PlaceFrame& frame : set_.frames) detector->add(frame);
    const double bytes = static_cast<double>(detector->descriptor_bytes()) /
                         static_cast<double>(std::max<std::size_t>(1, set_.frames.size()));
    std::vector<std::vector<places::ScoredPlace>> candidates(queries_.size());
    std::vector<double> query_ms(queries_.size());
    Answers alone{name, "none", std::vector<Answer>(queries_.size()), bytes};
    tools::run_in_parallel(
        queries_.size(), options_.jobs, set_.name + " " + name, stop_, [&](std::size_t q) {
          const double begin_s = tools::thread_time_s();
          candidates[q] =
              detector->query(set_.frames[queries_[q]], {newest_of(q), options_.candidates});
          query_ms[q] = 1e3 * (tools::thread_time_s() - begin_s);
          alone.answers[q] = by_detector(q, candidates[q]);
          alone.answers[q].ms = query_ms[q];
        });
    results.push_back(std::move(alone));

    for (const std::string& verifier : verifiers)
      results.push_back(verified(name, verifier, candidates, query_ms, bytes));
  }

 private:
  places::FrameId newest_of(std::size_t q) const {
    return static_cast<places::FrameId>(queries_[q] - options_.frames_earlier);
  }

  Answers verified(const std::string& detector, const std::string& name,
                   const std::vector<std::vector<places::ScoredPlace>>& candidates,
                   const std::vector<double>& query_ms, double bytes) const {
    const auto verifier = places::make_verifier(name, verifier_parameters(options_));
    Answers result{detector, name, std::vector<Answer>(queries_.size()), bytes};
    tools::run_in_parallel(queries_.size(), options_.jobs, set_.name + " " + detector + " " + name,
                           stop_, [&](std::size_t q) {
                             const double begin_s = tools::thread_time_s();
                             result.answers[q] = by_verifier(q, candidates[q], *verifier);
                             result.answers[q].ms =
                                 query_ms[q] + 1e3 * (tools::thread_time_s() - begin_s);
                           });
    return result;
  }

  Answer by_detector(std::size_t q, const std::vector<places::ScoredPlace>& candidates) const {
    if (candidates.empty()) return nothing(q);
    const places::ScoredPlace& best = candidates.front();
    const geometry::SE2* pose = best.guesses.size() == 1 ? &best.guesses.front().mean : nullptr;
    return judged(q, best.frame, best.score, pose);
  }

  Answer by_verifier(std::size_t q, const std::vector<places::ScoredPlace>& candidates,
                     const places::PlaceVerifier& verifier) const {
    Answer best = nothing(q);
    double best_score = -std::numeric_limits<double>::infinity();
    for (const places::ScoredPlace& candidate : candidates) {
      const places::PlaceFrame& frame = set_.frames[static_cast<std::size_t>(candidate.frame)];
      const auto found = verifier.verify(set_.frames[queries_[q]], frame, candidate.guesses);
      if (!found || found->score <= best_score) continue;
      best_score = found->score;
      best = judged(q, candidate.frame, found->score, &found->frame_T_query);
    }
    return best;
  }

  Answer nothing(std::size_t q) const {
    Answer answer;
    const Eigen::Vector2d here = set_.world_T_level[queries_[q]].translation();
    for (std::size_t i = 0; i <= queries_[q] - options_.frames_earlier; ++i) {
      answer.has_match |= (set_.world_T_level[i].translation() - here).norm() <= options_.radius_m;
    }
    return answer;
  }

  Answer judged(std::size_t q, places::FrameId id, double score, const geometry::SE2* pose) const {
    Answer answer = nothing(q);
    const geometry::SE2 truth = set_.world_T_level[static_cast<std::size_t>(id)].inverse() *
                                set_.world_T_level[queries_[q]];
    answer.has_answer = true;
    answer.score = score;
    answer.is_right = truth.translation().norm() <= options_.radius_m;
    if (pose == nullptr) return answer;

    answer.error_m = (pose->translation() - truth.translation()).norm();
    answer.has_pose =
        answer.error_m <= options_.pose_m &&
        std::abs(geometry::wrap_angle(pose->theta() - truth.theta())) <= options_.pose_rad;
    return answer;
  }

  const FrameSet& set_;
  TrialOptions options_;
  const std::atomic<bool>& stop_;
  std::vector<std::size_t> queries_;
};

}  // namespace

std::vector<std::size_t> queries_of(const FrameSet& set, const TrialOptions& options) {
  std::vector<std::size_t> queries;
  if (set.frames.size() <= options.frames_earlier) return queries;
  const std::size_t possible = set.frames.size() - options.frames_earlier;
  const std::size_t count =
      std::min(possible, set.has_clouds ? options.most_cloud_queries : options.most_queries);
  queries.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    queries.push_back(options.frames_earlier + i * possible / count);
  return queries;
}

std::vector<Answers> run_trials(const FrameSet& set, const std::vector<std::string>& detectors,
                                const std::vector<std::string>& verifiers,
                                const TrialOptions& options, const std::atomic<bool>& stop) {
  Trials trials(set, options, stop);
  std::vector<Answers> results;
  for (const std::string& detector : detectors) trials.add(detector, verifiers, results);
  return results;
}

DetectorScore score_of(const std::vector<Answer>& answers, double threshold) {
  DetectorScore score;
  std::vector<const Answer*> answered;
  std::size_t right = 0, right_accepted = 0;
  for (const Answer& answer : answers) {
    ++(answer.has_match ? score.queries : score.queries_without_match);
    if (!answer.has_answer) continue;
    answered.push_back(&answer);
    right += answer.is_right ? 1 : 0;
    if (answer.score <= threshold) continue;
    ++(answer.is_right ? right_accepted : score.wrong_accepted);
    score.wrong_poses_accepted += answer.is_right && !answer.has_pose ? 1 : 0;
  }
  if (score.queries == 0) return score;
  const auto all = static_cast<double>(score.queries);
  score.recall_at_1 = static_cast<double>(right) / all;
  score.recall_accepted = static_cast<double>(right_accepted) / all;

  // Every score as threshold, from the highest: answers of one score go together.
  std::stable_sort(answered.begin(), answered.end(),
                   [](const Answer* a, const Answer* b) { return a->score > b->score; });
  const std::size_t stride = std::max<std::size_t>(1, answered.size() / kCurvePoints);
  double hits = 0.0, wrong = 0.0;
  for (std::size_t i = 0; i < answered.size(); ++i) {
    (answered[i]->is_right ? hits : wrong) += 1.0;
    const bool is_last = i + 1 == answered.size();
    if (!is_last && answered[i + 1]->score == answered[i]->score) continue;
    score.max_f1 = std::max(score.max_f1, 2.0 * hits / (hits + wrong + all));
    if (wrong == 0.0) score.recall_zero_wrong = hits / all;
    if (i % stride == 0 || is_last) score.curve.emplace_back(hits / all, hits / (hits + wrong));
  }
  return score;
}

double highest_wrong_score(const std::vector<Answer>& answers) {
  double highest = -std::numeric_limits<double>::infinity();
  for (const Answer& answer : answers) {
    if (answer.has_answer && !answer.is_right) highest = std::max(highest, answer.score);
  }
  return highest;
}

}  // namespace understory::eval::experiments::loop_detectors
