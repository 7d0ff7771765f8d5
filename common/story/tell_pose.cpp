#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/story/tell.hpp"
#include "common/story/words.hpp"

namespace understory::story {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

/// Difference of two arbitrary stamps.
double apart_us(model::Utime a, model::Utime b) {
  return std::abs(static_cast<double>(a) - static_cast<double>(b));
}

bool means_something(const model::SlamPose& pose) {
  return !pose.status || *pose.status == model::MapUpdateStatus::kFirstMap ||
         *pose.status == model::MapUpdateStatus::kUpdated;
}

/// The pose with the largest value among those that have one.
template <class Value>
const PoseRecord* largest(const History<PoseRecord>& poses, const Value& value_of) {
  const PoseRecord* best = nullptr;
  double most = 0.0;
  for (const PoseRecord& one : poses) {
    const std::optional<double> value = value_of(one);
    if (!value || (best != nullptr && *value <= most)) continue;
    best = &one;
    most = *value;
  }
  return best;
}

const PoseRecord* chosen(const PoseBook& book, const PoseQuestion& question) {
  switch (question.choice) {
    case PoseQuestion::Choice::kLast:
      return book.poses().newest([](const PoseRecord&) { return true; });
    case PoseQuestion::Choice::kWorst:
      return largest(book.poses(), [](const PoseRecord& one) -> std::optional<double> {
        if (!means_something(one.pose)) return std::nullopt;
        return largest_sigma_m(one.pose.covariance);
      });
    case PoseQuestion::Choice::kSlowest:
      return largest(book.poses(), [&](const PoseRecord& one) { return book.latency_ms(one); });
    case PoseQuestion::Choice::kNearest:
      break;
  }
  return largest(book.poses(), [&](const PoseRecord& one) -> std::optional<double> {
    return -apart_us(one.pose.utime, question.utime);
  });
}

std::string no_pose(const PoseBook& book, const PoseQuestion& question) {
  if (book.poses().size() == 0) return "pose: there is no SLAM_POSE among the messages";
  if (question.choice == PoseQuestion::Choice::kSlowest) {
    return book.is_replayed()
               ? "pose slowest: times are not known: the messages are of a replay, which gives all "
                 "that comes of one input the same receive time"
               : "pose slowest: times are not known: stamps and receive times are of different "
                 "clocks, and LANDMARKS are missing";
  }
  return "pose worst: no SLAM_POSE means anything: all are not sure, lost or rejected";
}

std::string pose_words(const geometry::SE2& pose) {
  return fmt::format("{}, heading {:.2f} deg", place_words(pose.translation()),
                     pose.theta() * kDegrees);
}

/// In the vehicle's frame, like the covariance.
std::string pose_sigma_words(const Eigen::Matrix3d& covariance) {
  const Eigen::Vector3d sigmas = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  return fmt::format("{:.3f} m ahead, {:.3f} m aside, {:.3f} deg; largest {:.3f} m", sigmas.x(),
                     sigmas.y(), sigmas.z() * kDegrees, largest_sigma_m(covariance));
}

std::string correction_words(const PoseBook& book, const PoseRecord& record, model::Utime start) {
  const std::uint64_t version = record.pose.correction_version;
  if (version == 0) return "none in force: the submap's frame is that of the map";
  const CorrectionRecord* const found = book.corrections().newest(
      [&](const CorrectionRecord& one) { return one.version == version; });
  if (found == nullptr)
    return fmt::format("version {} of MAP_CORRECTION, which is not among the messages", version);
  return fmt::format("version {} of MAP_CORRECTION, first heard of {} with {}", version,
                     when(found->utime, start), counted(found->submaps, "submap"));
}

std::string reset_words(const PoseRecord& record, const PoseRecord* previous) {
  const model::SlamPose& pose = record.pose;
  if (pose.reset_counter == 0) return "no jump so far";
  const bool is_now = previous != nullptr && previous->pose.reset_counter != pose.reset_counter;
  const std::string jump =
      pose.reset_delta.coordinates().isZero(0.0)
          ? "a change of map: nothing leads from one frame to the other"
          : fmt::format("by {:.3f} m and {:.2f} deg", pose.reset_delta.translation().norm(),
                        pose.reset_delta.theta() * kDegrees);
  return is_now ? fmt::format("the pose jumped here (reset {}), {}", pose.reset_counter, jump)
                : fmt::format("no jump here; {} before, the latest {}",
                              counted(pose.reset_counter, "jump"), jump);
}

std::string latency_words(const PoseBook& book, const PoseRecord& record) {
  if (book.is_replayed())
    return "not known: the messages are of a replay, which gives all that comes of one input the "
           "same receive time";
  const std::optional<double> ms = book.latency_ms(record);
  if (!ms) return "not known: stamps and receive times are of different clocks";
  if (is_same_clock(record.pose.utime, record.arrival.received_us))
    return fmt::format("{:.1f} ms from the stamp of the observation", *ms);
  return fmt::format(
      "{:.1f} ms from LANDMARKS; before that it is not known: stamps are of another clock", *ms);
}

std::string asked_words(const PoseRecord& record, const PoseQuestion& question) {
  if (question.choice != PoseQuestion::Choice::kNearest) return "";
  const double apart = apart_us(record.pose.utime, question.utime);
  if (apart == 0.0) return "";
  return fmt::format("utime {}; the nearest SLAM_POSE is {:.3f} s {}", question.utime, 1e-6 * apart,
                     record.pose.utime < question.utime ? "before" : "behind");
}

void pose_facts(Story& story, const PoseBook& book, const PoseRecord& record,
                const PoseQuestion& question, model::Utime start) {
  const auto add = [&](const char* name, std::string text) {
    if (!text.empty()) story.facts.emplace_back(name, std::move(text));
  };
  const model::SlamPose& pose = record.pose;
  add("asked for", asked_words(record, question));
  add("time", when(pose.utime, start));
  add("status", status_words(pose) +
                    (pose.is_provisional ? "; the map is provisional: it may be dropped" : ""));
  if (means_something(pose)) {
    add("pose", pose_words(pose.map_T_vehicle()) + ", frame map");
    add("sigma", pose_sigma_words(pose.covariance));
  }
  add("map", fmt::format("{}, submap {}", pose.map_id, pose.submap_id));

  const PoseRecord* const previous = book.poses().newest(
      [&](const PoseRecord& one) { return one.arrival.order < record.arrival.order; });
  add("correction", correction_words(book, record, start));
  add("reset", reset_words(record, previous));
  add("sensor to pose", latency_words(book, record));
  add("limits", dropped_words("poses", book.poses().dropped()));
}

/// The verdicts on the latest keyframes: the reason why it coasts or is lost.
void verdicts(Story& story, const PoseBook& book, const PoseRecord& record) {
  constexpr std::size_t kVerdicts = 8;
  std::vector<StoryEvent> latest;
  for (std::size_t i = book.updates().size(); i > 0 && latest.size() < kVerdicts; --i) {
    const UpdateRecord& one = book.updates()[i - 1];
    if (one.arrival.order > record.arrival.order) continue;
    latest.push_back(
        {one.utime, fmt::format("keyframe {}: {}, {}{}{}{}", one.keyframe, status_words(one.status),
                                counted(one.inliers, "inlier"), one.is_lost ? "; lost" : "",
                                one.reason.empty() ? "" : "; ", one.reason)});
  }
  story.events.assign(latest.rbegin(), latest.rend());
}

/// Adds the sigmas of the poses up to this one.
void sigma_series(Story& story, const PoseBook& book, const PoseRecord& record) {
  constexpr std::size_t kPoses = 100;
  StorySeries series{"largest sigma of the position", "m", {}, {}};
  for (std::size_t i = book.poses().size(); i > 0 && series.t.size() < kPoses; --i) {
    const PoseRecord& one = book.poses()[i - 1];
    if (one.arrival.order > record.arrival.order || !means_something(one.pose)) continue;
    series.t.push_back(one.pose.utime);
    series.v.push_back(largest_sigma_m(one.pose.covariance));
  }
  std::ranges::reverse(series.t);
  std::ranges::reverse(series.v);
  if (!series.t.empty()) story.series.push_back(std::move(series));
}

}  // namespace

Answer tell_pose(const PoseBook& book, const PoseQuestion& question, model::Utime start) {
  const PoseRecord* const record = chosen(book, question);
  if (record == nullptr) return {std::nullopt, no_pose(book, question)};
  Story story;
  story.title = "pose at " + when(record->pose.utime, start);
  pose_facts(story, book, *record, question, start);
  verdicts(story, book, *record);
  sigma_series(story, book, *record);
  story.steps = steps_to(book, *record);
  return {std::move(story), ""};
}

}  // namespace understory::story
