// A store that is killed while it writes: what it confirmed is there.
#include <csignal>

#include "common/map_file/drive_file.hpp"
#include "tests/map_file/map_fixture.hpp"
#include "tests/submap_store/store_fixture.hpp"

using namespace understory;
using namespace understory::test;
using map_file::DriveFile;

namespace {

constexpr std::size_t kLandmarks = 25;

/// Of the same number always the same. Every fourth one replaces the one two before it.
model::Submap numbered(model::SubmapId id) {
  std::mt19937_64 random(4000 + id);
  model::Submap submap = random_submap(1, id, random, kLandmarks);
  if (id % 4 == 0) submap.replaced = {id - 2};
  return submap;
}

bool is_replaced(model::SubmapId id, model::SubmapId newest) {
  return id % 4 == 2 && id + 2 <= newest;
}

geometry::SE2 corrected(model::SubmapId id, model::SubmapId newest) {
  return {static_cast<double>(id), static_cast<double>(newest), 0.01};
}

constexpr char kSubmapStored = '+';
constexpr char kStateStored = '=';

/// Stores submap after submap, corrections and ground in between, until it is killed; a byte into
/// the pipe for each submap and for each existence state that is stored.
[[noreturn]] void store_for_ever(const std::filesystem::path& path, model::SubmapId next,
                                 int pipe) {
  try {
    if (!std::filesystem::exists(path)) DriveFile::make(path);
    for (;;) {
      DriveFile file(path);
      for (int i = 0; i < 6; ++i, ++next) {
        file.put(numbered(next), numbered(next).map_T_submap);
        if (::write(pipe, &kSubmapStored, 1) != 1) ::_exit(1);
        model::MapCorrection correction;
        correction.utime = numbered(next).utime;
        correction.version = next;
        for (model::SubmapId id = 1; id <= next; ++id)
          correction.submaps.push_back({id, corrected(id, next)});
        file.put(correction);
        model::MapLandmark live;
        live.id = map_file::landmark_id(1, 1);
        live.position_m.x() = static_cast<double>(next);
        file.put(map_file::GroundChange{1, numbered(next).utime, {live}, {}, {}, true});
        file.put(existence_state(1, numbered(next).utime, {live.id}, std::to_string(next)));
        if (::write(pipe, &kStateStored, 1) != 1) ::_exit(1);
        file.draw(3);
      }
      // Sealing and closing are moments of their own.
      if (next % 4 == 1) file.seal();
    }
  } catch (...) {
    ::_exit(2);
  }
}

struct Confirmed {
  std::uint64_t submaps = 0;
  std::uint64_t states = 0;
};

Confirmed stored_before_death(const std::filesystem::path& path, model::SubmapId next, int submaps,
                              int delay_us) {
  int ends[2];
  REQUIRE(::pipe(ends) == 0);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) store_for_ever(path, next, ends[1]);
  ::close(ends[1]);

  Confirmed confirmed;
  const auto read_one = [&] {
    char c = 0;
    if (::read(ends[0], &c, 1) != 1) return false;
    ++(c == kSubmapStored ? confirmed.submaps : confirmed.states);
    return true;
  };
  while (confirmed.submaps < static_cast<std::uint64_t>(submaps) && read_one()) {
  }
  ::usleep(static_cast<useconds_t>(delay_us));
  ::kill(child, SIGKILL);
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  REQUIRE(WIFSIGNALED(status));
  while (read_one()) {
  }
  ::close(ends[0]);
  return confirmed;
}

/// All submaps up to `newest` are there, their landmarks where the latest correction puts them, and
/// an existence state of `confirmed_state` or a later round.
void check_submaps(const std::filesystem::path& path, model::SubmapId newest,
                   model::SubmapId confirmed_state) {
  std::size_t kept = 0;
  {
    DriveFile file(path);
    for (model::SubmapId id = 1; id <= newest; ++id) {
      const auto submap = file.get({1, id});
      CHECK(submap.has_value() != is_replaced(id, newest));
      if (!submap) continue;
      ++kept;
      CHECK(submap->payload == numbered(id).payload);
    }
  }
  const MapFile opened(path, Access::kRead);
  const auto findings = opened.check();
  CAPTURE(findings);
  CHECK(findings.empty());
  if (newest == 0) return;
  const StoredMap map = opened.read(1);
  std::size_t of_submaps = 0;
  for (const auto& one : map.landmarks) of_submaps += one.submap_id ? 1 : 0;
  CHECK(of_submaps == kept * kLandmarks);

  // The state of the one landmark beside them is whole.
  if (confirmed_state == 0) return;
  REQUIRE(map.existence);
  REQUIRE(map.existence->landmarks.size() == 1);
  const auto& row = map.existence->landmarks[0];
  const auto round = static_cast<model::SubmapId>(std::stoull(row.state));
  CHECK(round >= confirmed_state);
  CHECK(round <= newest);
  CHECK(row.utime == numbered(round).utime);
  CHECK(map.existence->learned == "model " + row.state);
}

void kill_stores(int times, std::uint64_t seed) {
  const TemporaryDirectory directory;
  std::filesystem::path path;
  std::mt19937_64 random(seed);
  std::uint64_t before = 0;
  std::uint64_t confirmed_state = 0;
  std::uint64_t in_all = 0;
  std::uint64_t in_flight = 0;
  for (int i = 0; i < times; ++i) {
    if (i % 5 == 0) {
      path = directory / fmt::format("drive-{}.gpkg", i);
      before = 0;
      confirmed_state = 0;
    }
    const auto [stored, states] = stored_before_death(
        path, before + 1, static_cast<int>(random() % 8), static_cast<int>(random() % 25'000));
    CAPTURE(i, before, stored, states);
    if (states > 0) confirmed_state = before + states;
    if (!std::filesystem::exists(path)) {
      CHECK(stored == 0);
      continue;
    }
    // Half of the time the next one to open it is `understory map`.
    if (random() % 2 == 0) CHECK(MapFile(path, Access::kRead).check().empty());
    std::uint64_t there = 0;
    {
      const DriveFile file(path);
      std::uint64_t missing = 0;
      for (model::SubmapId id = 1; missing < 3; ++id) {
        if (file.get({1, id})) {
          there = id;
          missing = 0;
        } else {
          ++missing;
        }
      }
    }
    CHECK(there >= before + stored);
    CHECK(there <= before + stored + 1);
    check_submaps(path, there, confirmed_state);
    in_all += stored;
    in_flight += there - before - stored;
    before = there;
  }
  WARN(fmt::format("{} kills: {} submaps reported, all there; {} more were whole", times, in_all,
                   in_flight));
}

}  // namespace

TEST_CASE("killed at any moment, a store has every submap that it confirmed", "[submap_store]") {
  kill_stores(20, 92);
}

TEST_CASE("a store killed two hundred times", "[.long]") { kill_stores(200, 93); }
