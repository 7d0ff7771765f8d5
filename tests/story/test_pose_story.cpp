#include <algorithm>

#include "common/story/story_book.hpp"
#include "common/wire/convert.hpp"
#include "tests/catch.hpp"
#include "tests/story/random_drive.hpp"

using namespace understory;
using Catch::Matchers::Contains;
using story::PoseQuestion;
using story::StoryBook;
using test::stamped;

namespace {

constexpr std::int64_t kEpoch = 1'700'000'000'000'000;

std::string fact(const story::Story& story, const std::string& name) {
  for (const auto& [known, value] : story.facts)
    if (known == name) return value;
  return {};
}

const story::StoryStep& step(const story::Story& story, const std::string& name) {
  const auto found = std::ranges::find(story.steps, name, &story::StoryStep::name);
  REQUIRE(found != story.steps.end());
  return *found;
}

/// When the messages of one scan come, after its stamp [us].
struct Delays {
  std::int64_t raw = 5'000;
  std::int64_t laser = 7'000;
  std::int64_t landmarks = 17'000;
  std::int64_t keyframe = 18'000;
  std::int64_t update = 30'000;
  std::int64_t pose = 31'000;
};

/// A stack whose messages come `offset` later than the stamps say; one scan every 0.2 s, the scan
/// of each makes a keyframe.
class Stack {
 public:
  StoryBook book;
  std::int64_t offset_us = 0;
  bool is_replay = false;
  std::string left_out;

  void scan(Delays delays = {},
            std::optional<model::MapUpdateStatus> status = model::MapUpdateStatus::kUpdated,
            double sigma_m = 0.1) {
    utime_ += 200'000;
    const auto at = [&](std::int64_t delay) {
      return is_replay ? utime_ : utime_ + offset_us + delay;
    };
    put("RAW_SCAN", planar(), at(delays.raw));
    put("LIDAR_SCAN", planar(), at(delays.laser));
    put("ODOMETRY", odometry(), at(delays.laser + 10));
    model::LandmarkScan landmarks;
    landmarks.utime = utime_;
    landmarks.sequence = sequence_;
    landmarks.field_of_view.max_range_m = 30.0;
    landmarks.detections.resize(3);
    for (auto& one : landmarks.detections) one.covariance_m2 = Eigen::Matrix3d::Identity();
    put("LANDMARKS", landmarks, at(delays.landmarks));

    if (status) put("KEYFRAME", keyframe(), at(delays.keyframe));
    if (status) put("SLAM_UPDATE", update(*status), at(delays.update));
    put("SLAM_POSE", pose(status, sigma_m), at(delays.pose));
    ++sequence_;
  }
  model::Utime utime() const { return utime_; }

 private:
  template <class Value>
  void put(const std::string& channel, const Value& value, std::int64_t received_us) {
    if (channel == left_out) return;
    book.take(channel, wire::encode_message(value), received_us);
    REQUIRE(book.malformed() == 0);
  }
  model::PlanarScan planar() const {
    model::PlanarScan scan;
    scan.utime = utime_;
    scan.bearing_step_rad = 0.01;
    scan.max_range_m = 30.0;
    scan.ranges_m = {1.0F, 2.0F};
    return scan;
  }
  model::Odometry odometry() const {
    model::Odometry odometry;
    odometry.from_utime = utime_ - 200'000;
    odometry.utime = utime_;
    odometry.from_T_to = {0.5, 0.0, 0.0};
    odometry.has_wheels = true;
    odometry.covariance = 0.01 * Eigen::Matrix3d::Identity();
    return odometry;
  }
  model::Keyframe keyframe() const {
    model::Keyframe keyframe;
    keyframe.utime = utime_;
    keyframe.sequence = sequence_;
    keyframe.field_of_view.max_range_m = 30.0;
    model::KeyframeMember member;
    member.utime = utime_;
    member.sequence = sequence_;
    member.covariance = 0.01 * Eigen::Matrix3d::Identity();
    keyframe.members = {member};
    return keyframe;
  }
  model::MapUpdate update(model::MapUpdateStatus status) const {
    model::MapUpdate update;
    update.utime = utime_;
    update.keyframe_sequence = sequence_;
    update.status = status;
    update.inliers = 12;
    update.chi2 = 20.5;
    update.degrees_of_freedom = 24;
    update.used_prior = true;
    update.covariance = 0.01 * Eigen::Matrix3d::Identity();
    if (status == model::MapUpdateStatus::kNotSure) update.reason = "too few hits";
    return update;
  }
  model::SlamPose pose(std::optional<model::MapUpdateStatus> status, double sigma_m) const {
    model::SlamPose pose;
    pose.utime = utime_;
    pose.sequence = sequence_;
    pose.status = status;
    if (status) pose.keyframe_sequence = sequence_;
    pose.is_coasting = !status;
    pose.submap_T_vehicle = {1.0, 2.0, 0.5};
    pose.covariance = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
    return pose;
  }

  model::Utime utime_ = kEpoch;
  std::uint64_t sequence_ = 0;
};

}  // namespace

TEST_CASE("the way from the sensor to a pose, with the time that each message took", "[story]") {
  Stack stack;
  for (int i = 0; i < 3; ++i) stack.scan();
  const auto story = stack.book.pose({PoseQuestion::Choice::kLast, 0}).story.value();
  CHECK(story.title == "pose at 0.400 s (utime 1700000000600000)");
  CHECK_THAT(fact(story, "status"), Contains("localised"));
  CHECK_THAT(fact(story, "sigma"), Contains("largest 0.100 m"));
  CHECK(fact(story, "sensor to pose") == "31.0 ms from the stamp of the observation");
  CHECK(fact(story, "reset") == "no jump so far");

  double sum_ms = 0.0;
  for (const auto& one : story.steps) sum_ms += one.ms.value_or(0.0);
  CHECK(sum_ms == Approx(31.0));
  CHECK(step(story, "RAW_SCAN").ms.value() == Approx(5.0));
  CHECK(step(story, "LIDAR_SCAN").ms.value() == Approx(2.0));
  CHECK(step(story, "LANDMARKS").ms.value() == Approx(10.0));
  CHECK(step(story, "KEYFRAME").ms.value() == Approx(1.0));
  CHECK(step(story, "SLAM_UPDATE").ms.value() == Approx(12.0));
  CHECK(step(story, "SLAM_POSE").ms.value() == Approx(1.0));

  CHECK_THAT(step(story, "SLAM_UPDATE").text,
             Contains("localised and fused: 12 inliers, chi2 20.5 of 24, in gates"));
  CHECK_THAT(step(story, "ODOMETRY").text,
             Contains("1 increment since the pose before: 0.500 m") && Contains("from wheels"));
  CHECK_FALSE(step(story, "ODOMETRY").ms);
  CHECK_THAT(step(story, "EKF_POSE").text, Contains("this channel was not recorded"));
}

TEST_CASE("a pose is chosen by time, by sigma and by how long it took", "[story]") {
  Stack stack;
  stack.scan();
  stack.scan({}, model::MapUpdateStatus::kUpdated, 0.7);
  Delays slow;
  slow.pose = 90'000;
  stack.scan(slow);
  stack.scan({}, model::MapUpdateStatus::kNotSure, 5.0);
  using enum PoseQuestion::Choice;
  const auto title = [&](const PoseQuestion& question) {
    return stack.book.pose(question).story.value().title;
  };
  CHECK_THAT(title({kWorst, 0}), Contains("0.200 s"));
  CHECK_THAT(title({kSlowest, 0}), Contains("0.400 s"));
  CHECK_THAT(title({kLast, 0}), Contains("0.600 s"));
  CHECK_THAT(title({kNearest, kEpoch + 420'000}), Contains("0.200 s"));
  CHECK_THAT(title({kNearest, std::numeric_limits<std::int64_t>::max()}), Contains("0.600 s"));
  CHECK_THAT(fact(stack.book.pose({kNearest, kEpoch}).story.value(), "asked for"),
             Contains("0.200 s behind"));
  CHECK_THAT(StoryBook().pose({kLast, 0}).error, Contains("no SLAM_POSE"));

  // What means nothing has no place; what was wrong is said.
  const auto unsure = stack.book.pose({kLast, 0}).story.value();
  CHECK(fact(unsure, "pose").empty());
  CHECK_THAT(fact(unsure, "status"), Contains("not sure"));
  CHECK_THAT(step(unsure, "SLAM_UPDATE").text, Contains("too few hits"));
  CHECK_THAT(unsure.events.back().text, Contains("not sure where it is, 12 inliers; too few hits"));
}

TEST_CASE("times of a replay are not taken for measured ones", "[story]") {
  Stack stack;
  stack.is_replay = true;
  for (int i = 0; i < 3; ++i) stack.scan();
  const auto story = stack.book.pose({PoseQuestion::Choice::kLast, 0}).story.value();
  for (const auto& one : story.steps) CHECK_FALSE(one.ms);
  CHECK_THAT(fact(story, "sensor to pose"), Contains("not known: the messages are of a replay"));
  CHECK_THAT(stack.book.pose({PoseQuestion::Choice::kSlowest, 0}).error, Contains("of a replay"));
}

TEST_CASE("of a log that is played again the steps are known, the sensor's delay is not",
          "[story]") {
  Stack stack;
  stack.offset_us = 3'600'000'000;
  for (int i = 0; i < 3; ++i) stack.scan();
  const auto story = stack.book.pose({PoseQuestion::Choice::kSlowest, 0}).story.value();
  CHECK_FALSE(step(story, "RAW_SCAN").ms);
  CHECK(step(story, "LIDAR_SCAN").ms.value() == Approx(2.0));
  CHECK_THAT(fact(story, "sensor to pose"), Contains("14.0 ms from LANDMARKS"));
}

TEST_CASE("what was not recorded is said", "[story]") {
  for (const std::string channel :
       {"RAW_SCAN", "LANDMARKS", "KEYFRAME", "SLAM_UPDATE", "ODOMETRY"}) {
    Stack stack;
    stack.left_out = channel;
    stack.scan();
    CAPTURE(channel);
    const auto story = stack.book.pose({PoseQuestion::Choice::kLast, 0}).story.value();
    CHECK_THAT(step(story, channel).text, Contains("this channel was not recorded"));
    CHECK_FALSE(step(story, channel).ms);
  }
}

TEST_CASE("a pose between keyframes says so, and what it coasts on", "[story]") {
  Stack stack;
  stack.scan();
  stack.scan({}, std::nullopt);
  const auto story = stack.book.pose({PoseQuestion::Choice::kLast, 0}).story.value();
  CHECK(fact(story, "status") == "coasting: too few landmarks match, by odometry alone");
  CHECK_THAT(step(story, "KEYFRAME").text, Contains("number 0") && Contains("the latest"));
  CHECK_FALSE(step(story, "KEYFRAME").ms);
  CHECK(step(story, "SLAM_POSE").ms.value() == Approx(14.0));
}

TEST_CASE("sweeps are put together from their parts, raw and not", "[story]") {
  StoryBook book;
  model::PointSweep part;
  part.revolution = 9;
  part.parts = 3;
  part.points.resize(100);
  for (std::uint16_t i = 0; i < 3; ++i) {
    part.part = i;
    part.utime = kEpoch;
    book.take(part, true, kEpoch + 30'000 * (i + 1));
  }
  part.utime = kEpoch + 100'000;
  for (std::uint16_t i = 0; i < 2; ++i) book.take(part, false, kEpoch + 105'000 + i * 1000);
  book.take(stamped<model::LandmarkScan>(part.utime), kEpoch + 120'000);
  model::SlamPose pose;
  pose.utime = part.utime;
  book.take(pose, kEpoch + 121'000);

  const auto story = book.pose({PoseQuestion::Choice::kLast, 0}).story.value();
  CHECK_THAT(step(story, "RAW_SWEEP").text,
             Contains("300 points in 3 of 3 parts, the first 60.0 ms before the last"));
  CHECK_THAT(step(story, "LIDAR_SWEEP").text, Contains("200 points in 2 of 3 parts"));
  CHECK(step(story, "LIDAR_SWEEP").ms.value() == Approx(16.0));
}

TEST_CASE("corrections and jumps in words", "[story]") {
  StoryBook book;
  model::SlamPose pose;
  pose.utime = kEpoch;
  book.take(pose, 0);
  book.take(model::MapCorrection{kEpoch, 0, 1, 3, {{1, {}}, {2, {}}}}, 0);
  pose.utime += 100'000;
  pose.correction_version = 3;
  pose.reset_counter = 1;
  pose.reset_delta = {0.3, 0.4, 0.0};
  book.take(pose, 0);
  auto story = book.pose({PoseQuestion::Choice::kLast, 0}).story.value();
  CHECK_THAT(fact(story, "correction"), Contains("version 3") && Contains("2 submaps"));
  CHECK_THAT(fact(story, "reset"), Contains("the pose jumped here (reset 1), by 0.500 m"));
  pose.utime += 100'000;
  pose.correction_version = 4;
  book.take(pose, 0);
  story = book.pose({PoseQuestion::Choice::kLast, 0}).story.value();
  CHECK_THAT(fact(story, "correction"), Contains("not among the messages"));
  CHECK_THAT(fact(story, "reset"), Contains("no jump here; 1 jump before"));
}

TEST_CASE("bytes that are no message are counted and passed over", "[story]") {
  StoryBook book;
  const std::vector<std::uint8_t> noise(40, 0xAB);
  book.take("SLAM_POSE", noise, 1);
  book.take("RAW_SWEEP", noise, 1);
  book.take("HEALTH", noise, 1);
  CHECK(book.malformed() == 2);
}
