// The store as a process: killed, stopped and started again, it has what it confirmed.
#include <fmt/format.h>

#include "common/map_file/map_file.hpp"
#include "common/model/submap.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "tests/submap_store/store_fixture.hpp"
#include "tests/system/stack.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

/// `understory launch` with a store alone; this test is the mapper.
class StoreProcess {
 public:
  StoreProcess() : bus_(url_) {
    std::ofstream(directory_ / "submap_store.toml") << "";
    std::ofstream(directory_ / "launch.toml")
        << "[[process]]\nname = \"submap_store\"\nexecutable = \"understory-submap-store\"\n"
           "config = \"submap_store.toml\"\n";
    bus_.subscribe("HEALTH", 0, [this](const bus::BusMessage& message) {
      if (const auto one = wire::decode_message<health_t>(message.bytes))
        pid = static_cast<pid_t>(one->pid);
    });
    bus_.subscribe("SUBMAP_STORED", 0, [this](const bus::BusMessage& message) {
      if (const auto one = wire::decode_message<model::SubmapStored>(message.bytes))
        stored[one->id] = one->content_hash;
    });
    bus_.subscribe("SUBMAP_REPLY", 0, [this](const bus::BusMessage& message) {
      if (const auto one = wire::decode_message<model::Submap>(message.bytes))
        replies.insert_or_assign(one->id, *one);
    });
    start();
  }
  ~StoreProcess() { stop(); }

  void start() {
    pid = 0;
    launch_ = launch::ChildProcess::start(
        {UNDERSTORY_COMMAND,
         {"launch", "--config", directory_.path(), "--state-dir", directory_ / "state", "--lcm-url",
          url_, "--report", report(), "--quiet"},
         {}});
  }
  launch::Ending stop() {
    launch::Ending ending;
    if (!launch_) return ending;
    launch_->signal(SIGTERM);
    wait_until([&] {
      const auto ended = launch_->ended();
      if (ended) ending = *ended;
      return ended.has_value();
    });
    launch_.reset();
    return ending;
  }
  template <class Condition>
  bool wait_until(Condition condition, double seconds = 30.0) {
    const auto end = SteadyClock::now() + Seconds(seconds);
    while (!condition()) {
      if (SteadyClock::now() > end) return false;
      bus_.handle_one(10);
    }
    return true;
  }
  /// As the mapper does: again and again, until the answer is there.
  template <class T, class Condition>
  bool send_until(const std::string& channel, T message, Condition condition) {
    for (int i = 0; i < 60; ++i) {
      message.sequence = sequence_++;
      bus_.publish(channel, wire::encode_message(message));
      if (wait_until(condition, 0.5)) return true;
    }
    return false;
  }
  bool keep(const model::Submap& submap) {
    return send_until("SUBMAP", submap, [&] {
      const auto found = stored.find(submap.id);
      return found != stored.end() && found->second == submap.content_hash;
    });
  }
  std::string report() const { return directory_ / "report.json"; }
  std::filesystem::path maps() const {
    return directory_.path() / "state" / "submap_store" / "maps";
  }

  pid_t pid = 0;
  std::map<model::SubmapId, std::uint64_t> stored;
  std::map<model::SubmapId, model::Submap> replies;

 private:
  TemporaryDirectory directory_;
  std::string url_ = private_url();
  bus::LiveBus bus_;
  std::optional<launch::ChildProcess> launch_;
  std::uint64_t sequence_ = 0;
};

}  // namespace

TEST_CASE("a store that is killed, stopped and started again has what it confirmed",
          "[system][store]") {
  std::mt19937_64 random(41);
  std::vector<model::Submap> submaps;
  for (model::SubmapId id = 1; id <= 12; ++id) submaps.push_back(random_submap(1, id, random));
  StoreProcess store;
  REQUIRE(store.wait_until([&] { return store.pid > 0; }));

  for (std::size_t i = 0; i < submaps.size(); ++i) {
    CAPTURE(i);
    if (i == 4) {
      const pid_t before = store.pid;
      ::kill(before, SIGKILL);
      CHECK(store.wait_until([&] { return store.pid != before; }));
    }
    if (i == 8) {
      const launch::Ending ending = store.stop();
      CHECK(ending.exit_code == 0);
      CHECK_THAT(read_text(store.report()), Contains("killed by signal 9") &&
                                                !Contains("does not end") && !Contains("given up"));
      store.start();
      REQUIRE(store.wait_until([&] { return store.pid > 0; }));
    }
    REQUIRE(store.keep(submaps[i]));
  }

  const auto file = store.maps() / "drive-0001.gpkg";
  const Outcome refused =
      understory_command(TemporaryDirectory(), fmt::format("map info {}", file.string()));
  CHECK(refused.status == 1);
  CHECK_THAT(refused.error, Contains("another process has it open"));
  REQUIRE(store.send_until("SUBMAP_QUERY", query_for(1, {2, 7, 12}, 13'000'000),
                           [&] { return store.replies.size() == 3; }));
  for (const model::SubmapId id : {2, 7, 12}) check_same(submaps[id - 1], store.replies.at(id));
  store.stop();

  const Outcome checked =
      understory_command(TemporaryDirectory(), fmt::format("map check {}", file.string()));
  CHECK(checked.status == 0);
  CHECK_THAT(checked.out, Contains("1 maps, 2 changes, nothing wrong"));
  CHECK(map_file::MapFile(file, map_file::Access::kRead).read(1).landmarks.size() == 12 * 40);
  CHECK_FALSE(std::filesystem::exists(store.maps() / "drive-0002.gpkg"));
}
