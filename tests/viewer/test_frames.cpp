#include <random>
#include <set>

#include "services/viewer/page_clients.hpp"
#include "tests/catch.hpp"
#include "tests/viewer/page_replica.hpp"

namespace understory {
namespace {

using viewer::Scene;
using viewer::SceneLandmark;

model::MapLandmark landmark(model::LandmarkId id, double x, double y) {
  model::MapLandmark one;
  one.id = id;
  one.position_m = {x, y};
  one.covariance_m2 = 0.01 * Eigen::Matrix2d::Identity();
  one.radius_m = 0.2;
  return one;
}

/// The change number `i` of a map, a landmark each.
model::MapDelta one_more(int i) {
  model::MapDelta delta;
  delta.base_version = static_cast<std::uint64_t>(i);
  delta.version = delta.base_version + 1;
  delta.added.push_back(landmark(delta.version, 0.1 * i, 0.0));
  return delta;
}

/// Feeds a scene with random changes of a map and a path.
class RandomDrive {
 public:
  RandomDrive(Scene& scene, std::uint64_t seed) : scene_(scene), random_(seed) {}

  void step() {
    switch (random_() % 8) {
      case 0:
      case 1:
      case 2:
        change_map();
        break;
      case 3:
        tell_existence();
        break;
      case 4:
        move_keyframes();
        break;
      default:
        move();
    }
    if (random_() % 400 == 0) new_map();
  }
  std::uint64_t random() { return random_(); }

 private:
  double metres() { return 1e-3 * static_cast<double>(random_() % 100'000); }

  void change_map() {
    model::MapDelta delta;
    delta.base_version = version_;
    delta.version = ++version_;
    for (std::uint64_t i = random_() % 4; i > 0; --i) {
      ids_.push_back(++last_id_);
      delta.added.push_back(landmark(last_id_, metres(), metres()));
    }
    for (std::uint64_t i = random_() % 3; i > 0 && !ids_.empty(); --i)
      delta.moved.push_back(landmark(ids_[random_() % ids_.size()], metres(), metres()));
    if (random_() % 3 == 0 && ids_.size() > 4) {
      const std::size_t which = random_() % ids_.size();
      const model::LandmarkId id = ids_[which];
      ids_.erase(ids_.begin() + static_cast<std::ptrdiff_t>(which));
      std::erase_if(delta.moved, [&](const auto& one) { return one.id == id; });
      std::erase_if(delta.added, [&](const auto& one) { return one.id == id; });
      if (random_() % 2 == 0) {
        delta.removed.push_back(id);
      } else {
        delta.merged.emplace_back(id, ids_.front());
      }
    }
    scene_.take(delta);
  }
  void tell_existence() {
    if (ids_.empty()) return;
    model::Existence existence;
    existence.landmarks.push_back({.id = ids_[random_() % ids_.size()],
                                   .probability = 0.001 * static_cast<double>(random_() % 1000),
                                   .is_in_use = random_() % 2 == 0});
    scene_.take(existence);
  }
  void move() {
    model::SlamPose pose;
    pose.utime = utime_ += 100'000;
    pose.submap_T_vehicle = geometry::SE2(metres(), metres(), 0.1);
    pose.covariance = 1e-4 * Eigen::Matrix3d::Identity();
    pose.map_id = map_id_;
    scene_.take(pose, utime_);
  }
  void move_keyframes() {
    model::WholeMap map;
    map.version = version_;
    for (const SceneLandmark& one : scene_.landmarks().slots()) {
      if ((one.flags & SceneLandmark::kThere) != 0)
        map.landmarks.push_back(landmark(one.id, one.x_m, one.y_m));
    }
    std::ranges::sort(map.landmarks, {}, &model::MapLandmark::id);
    ++keyframes_;
    for (std::uint64_t k = random_() % keyframes_; k < keyframes_; ++k)
      map.keyframes.push_back(
          {k, static_cast<model::Utime>(k), {metres(), metres(), 0.0}, Eigen::Matrix3d::Zero()});
    scene_.take(map);
  }
  void new_map() {
    model::MapUpdate update;
    update.status = model::MapUpdateStatus::kFirstMap;
    update.map_id = ++map_id_;
    scene_.take(update);
    ids_.clear();
    version_ = 0;
    keyframes_ = 0;
  }

  Scene& scene_;
  std::mt19937_64 random_;
  std::vector<model::LandmarkId> ids_;
  model::LandmarkId last_id_ = 0;
  std::uint64_t version_ = 0;
  std::uint64_t keyframes_ = 0;
  std::uint32_t map_id_ = 1;
  model::Utime utime_ = 0;
};

void check_same(const test::PageReplica& page, const Scene& scene) {
  REQUIRE(page.landmarks.size() == scene.landmarks().size());
  for (viewer::Slot slot = 0; slot < scene.landmarks().slots().size(); ++slot) {
    const SceneLandmark& one = scene.landmarks().slots()[slot];
    if ((one.flags & SceneLandmark::kThere) == 0) continue;
    const auto found = page.landmarks.find(slot);
    REQUIRE(found != page.landmarks.end());
    CHECK(found->second.id == one.id);
    CHECK(found->second.x == one.x_m);
    CHECK(found->second.flags == one.flags);
    CHECK((found->second.probability == one.probability || std::isnan(one.probability)));
  }
  REQUIRE(page.path.size() == scene.driven().points().size());
  for (std::size_t i = 0; i < page.path.size(); ++i)
    CHECK(page.path[i].first == scene.driven().points()[i].x_m);
  REQUIRE(page.keyframes.size() == scene.keyframes().points().size());
  for (std::size_t i = 0; i < page.keyframes.size(); ++i)
    CHECK(page.keyframes[i].second == scene.keyframes().points()[i].y_m);
}

}  // namespace

TEST_CASE("frames in pieces, whenever they come, give what the scene has", "[viewer]") {
  const auto seed = GENERATE(range(1, 21));
  Scene scene;
  RandomDrive drive(scene, static_cast<std::uint64_t>(seed));
  test::PageReplica page;
  viewer::SceneCursor cursor;

  for (int step = 0; step < 1500; ++step) {
    drive.step();
    if (drive.random() % 20 != 0) continue;
    viewer::FrameRequest request;
    request.most_landmarks = 1 + drive.random() % 30;
    request.most_points = 1 + drive.random() % 50;
    // Once so that something changes between two pieces, once to the end.
    page.take(test::PageFrame(*viewer::make_frame(scene, request, {}, cursor)));
    if (drive.random() % 4 != 0) continue;
    for (int i = 0; viewer::has_news(scene, cursor) && i < 10'000; ++i)
      page.take(test::PageFrame(*viewer::make_frame(scene, request, {}, cursor)));
    REQUIRE_FALSE(viewer::has_news(scene, cursor));
    check_same(page, scene);
  }
  CHECK(scene.change() > 1000);
}

TEST_CASE("a cross is a landmark in use that nothing hid, and the count is that of the crosses",
          "[viewer]") {
  Scene scene;
  model::MapDelta delta;
  delta.version = 1;
  for (model::LandmarkId id = 1; id <= 8; ++id) delta.added.push_back(landmark(id, 1.0, 0.0));
  scene.take(delta);
  model::Existence existence;
  for (const model::LandmarkId id : {6, 7}) existence.landmarks.push_back({id, 0.01, false});
  scene.take(existence);

  model::MapUpdate update;
  update.status = model::MapUpdateStatus::kUpdated;
  for (const model::LandmarkId id : {1, 2, 6, 8})
    update.associations.push_back({.landmark_id = id});
  update.added = {8};
  update.expected = {{.id = 3, .sight = model::LineOfSight::kUnknown},
                     {.id = 4, .sight = model::LineOfSight::kClear},
                     {.id = 5, .sight = model::LineOfSight::kBlocked},
                     {.id = 7, .sight = model::LineOfSight::kClear}};
  scene.take(update);

  viewer::SceneCursor cursor;
  const test::PageFrame frame(*viewer::make_frame(scene, {}, {}, cursor));
  std::set<std::uint64_t> crosses;
  const auto ids = frame.array<std::uint32_t>("id_low");
  for (const std::uint32_t slot : frame.array<std::uint32_t>("unseen_slot"))
    crosses.insert(ids.at(slot));
  CHECK(crosses == std::set<std::uint64_t>{3, 4});
  CHECK(frame.array<std::uint32_t>("match_slot").size() == 4);
  // 1 and 2 were seen, 3 and 4 were not; 6 is out of use, 8 is new.
  CHECK(frame.header.at("matches").at("expected") == 4);
}

TEST_CASE("a page that does not acknowledge gets two frames, then what it missed", "[viewer]") {
  Scene scene;
  RandomDrive drive(scene, 3);
  viewer::PageClients pages({&scene}, {}, 50'000);
  std::int64_t now_us = 1'000'000;
  pages.opened(7, {{"kind", "hello"}});
  test::PageReplica page;
  std::vector<std::uint64_t> unacknowledged;
  const auto exchange = [&] {
    for (const viewer::PageMessage& message : pages.frames(now_us, {})) {
      CHECK(message.client == 7);
      const test::PageFrame frame(*message.bytes);
      page.take(frame);
      unacknowledged.push_back(frame.header.at("seq"));
    }
  };

  // Nobody acknowledges.
  for (int i = 0; i < 200; ++i, now_us += 50'000) {
    drive.step();
    exchange();
  }
  CHECK(unacknowledged.size() == 2);
  CHECK(pages.skipped() > 150);

  // From now on somebody does.
  for (int i = 0; i < 20; ++i, now_us += 50'000) {
    std::optional<std::string> refusal;
    for (const std::uint64_t sequence : std::exchange(unacknowledged, {}))
      pages.take(7, nlohmann::json{{"ack", sequence}, {"shown_ms", 1e-3}}.dump(), refusal);
    CHECK_FALSE(refusal);
    exchange();
  }
  check_same(page, scene);
  CHECK(page.parts.at("skipped").get<std::uint64_t>() == pages.skipped());
  pages.closed(7);
  drive.step();
  CHECK(pages.frames(now_us, {}).empty());
}

TEST_CASE("frames come no faster than the period", "[viewer]") {
  Scene scene;
  RandomDrive drive(scene, 4);
  viewer::PageClients pages({&scene}, {}, 100'000);
  pages.opened(1, {});
  std::size_t frames = 0;
  for (std::int64_t now_us = 0; now_us < 10'000'000; now_us += 5'000) {
    drive.step();
    for (const viewer::PageMessage& message : pages.frames(now_us, {})) {
      ++frames;
      std::optional<std::string> refusal;
      const auto sequence = test::PageFrame(*message.bytes).header.at("seq");
      pages.take(1, nlohmann::json{{"ack", sequence}}.dump(), refusal);
    }
  }
  CHECK(frames >= 95);
  CHECK(frames <= 101);
}

TEST_CASE("poses set the pace of the frames, other news go along", "[viewer]") {
  Scene scene;
  viewer::PageClients pages({&scene}, {}, 50'000);
  pages.opened(1, {});
  std::size_t frames = 0;
  const auto exchange = [&](std::int64_t now_us) {
    bool is_due = false;
    for (const viewer::PageMessage& message : pages.frames(now_us, {})) {
      ++frames;
      is_due = true;
      std::optional<std::string> refusal;
      const auto sequence = test::PageFrame(*message.bytes).header.at("seq");
      pages.take(1, nlohmann::json{{"ack", sequence}}.dump(), refusal);
    }
    return is_due;
  };

  // Ten poses a second, and every 10 ms something else: no picture but those of the poses.
  std::int64_t now_us = 1'000'000;
  for (int i = 0; i < 1000; ++i, now_us += 10'000) {
    scene.take(one_more(i));
    const bool has_pose = i % 10 == 5;
    if (has_pose) {
      model::SlamPose pose;
      pose.utime = now_us;
      pose.submap_T_vehicle = geometry::SE2(0.01 * i, 0.0, 0.0);
      pose.covariance = 1e-4 * Eigen::Matrix3d::Identity();
      pose.map_id = 1;
      scene.take(pose, now_us);
    }
    const bool is_sent = exchange(now_us);
    if (i > 5) CHECK(is_sent == has_pose);
  }

  // Poses have ended: the rest comes three times slower than the period allows.
  frames = 0;
  for (int i = 1000; i < 2000; ++i, now_us += 10'000) {
    scene.take(one_more(i));
    exchange(now_us);
  }
  CHECK(frames >= 65);
  CHECK(frames <= 67);
}

TEST_CASE("what pages say and is not of the protocol is refused", "[viewer]") {
  Scene scene;
  int controls = 0;
  viewer::PageRequests requests;
  requests.control = [&](const nlohmann::json& /*control*/) { ++controls; };
  requests.story = [](const nlohmann::json& question) -> nlohmann::ordered_json {
    if (question.at("ask") == "landmark") return {{"title", "a landmark"}};
    throw std::runtime_error("no such pose");
  };
  viewer::PageClients pages({&scene}, requests, 50'000);
  pages.opened(1, {});
  const auto say = [&](const std::string& text) {
    std::optional<std::string> refusal;
    const auto answers = pages.take(1, text, refusal);
    return std::pair(answers, refusal);
  };

  for (const char* text : {"", "{", "[1]", "5", "{}", R"({"hello": 1})", R"({"ask": 5})"})
    CHECK(say(text).second);
  for (const char* text : {R"({"ack": -1})", R"({"ack": "x"})", R"({"ack": 99999999})",
                           R"({"ack": 1e300, "shown_ms": {}})", R"({"overlays": [1, "scan"]})",
                           R"({"seek": 5})", R"({"play": {}})", R"({"revision": 1})"})
    CHECK_FALSE(say(text).second);
  CHECK(controls == 3);

  const auto story = say(R"({"ask": "landmark", "id": "1", "request": 4})").first;
  REQUIRE(story.size() == 1);
  CHECK(test::PageFrame(*story[0].bytes).header.at("story").at("title") == "a landmark");
  CHECK(test::PageFrame(*story[0].bytes).header.at("request") == 4);
  const auto none = say(R"({"ask": "pose", "request": 5})").first;
  REQUIRE(none.size() == 1);
  CHECK(test::PageFrame(*none[0].bytes).header.at("error") == "no such pose");
  CHECK(say(R"({"ask": "pose", "request": "x"})").first.size() == 1);
}

TEST_CASE("text of processes that is no UTF-8 does not stop the page", "[viewer]") {
  Scene scene;
  log_t line{};
  line.process = "strange";
  line.text = std::string(2, '\xff');
  scene.take(line);
  viewer::SceneCursor cursor;
  const test::PageFrame frame(*viewer::make_frame(scene, {}, {}, cursor));
  CHECK(frame.header.at("log").at(0).at("process") == "strange");
}

}  // namespace understory
