// Mapper and store on one bus: a drive with hand-over is the drive without, and its file is its
// map.
#include <optional>

#include "common/map_file/drive_file.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/keyframer/adapter.hpp"
#include "sim/drive.hpp"
#include "tests/map_file/map_fixture.hpp"
#include "tests/submap_store/store_fixture.hpp"

using namespace understory;
using namespace understory::test;

namespace {

/// Keyframer, mapper and, where it is told to, a store.
class Vehicle {
 public:
  Vehicle(double hand_over_m, const std::filesystem::path& folder) {
    host(keyframer::keyframer_service(), "");
    host(geoslam_mapper::geoslam_mapper_service(),
         "[smoothing]\ncondense_m = 10.0\nhand_over_m = " + std::to_string(hand_over_m) + "\n");
    if (!folder.empty()) start_store(folder);
  }
  void drive(const sim::Drive& drive, std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      bus_.publish("LANDMARKS", wire::encode_message(drive.scan(k).scan));
      bus_.drain();
    }
  }
  void start_store(const std::filesystem::path& folder) {
    host(submap_store::submap_store_service(), "");
    auto& device = dynamic_cast<bus::Device&>(hosted_.back()->adapter());
    device.set_state_directory(folder);
    device.open();
  }
  void finish() {
    for (auto& one : hosted_) {
      one->adapter().finish();
      bus_.drain();
    }
    hosted_.clear();
  }

  std::vector<geometry::SE2> poses;
  std::size_t stored = 0;
  std::size_t replies = 0;

 private:
  void host(const bus::Service& service, const std::string& toml) {
    hosted_.push_back(std::make_unique<bus::HostedService>(service, bus_, bus::no_clock(), toml,
                                                           service.name + ".toml"));
    hosted_.back()->node().connect();
  }
  void hear(const bus::BusMessage& message) {
    if (message.channel == "SUBMAP_STORED") ++stored;
    if (message.channel == "SUBMAP_REPLY") ++replies;
    if (message.channel != "SLAM_UPDATE") return;
    const auto update = wire::decode_message<model::MapUpdate>(message.bytes).value();
    if (update.status == model::MapUpdateStatus::kUpdated) poses.push_back(update.map_T_vehicle);
  }

  bus::MemoryBus bus_{bus::MemoryBus::Queues::kUnlimited,
                      [this](const bus::BusMessage& message) { hear(message); }};
  std::vector<std::unique_ptr<bus::HostedService>> hosted_;
};

/// Out and back along a road in the forest, `length_m` in all.
sim::Drive long_lanes(double length_m, std::uint64_t seed) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.path.kind = sim::PathKind::kMeander;
  parameters.path.length_m = length_m;
  parameters.path.lane_length_m = 1000.0;
  parameters.path.lane_spacing_m = 60.0;
  parameters.sensor.range_m = 20.0;
  parameters.sensor.position_sigma_m = 0.05;
  parameters.clear_the_path = true;
  return {parameters, seed};
}

/// Two lanes, the second in sight of the first: what was handed over comes back.
sim::Drive two_lanes(std::uint64_t seed) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.path.kind = sim::PathKind::kMeander;
  parameters.path.length_m = 680.0;
  parameters.path.lane_length_m = 330.0;
  parameters.path.lane_spacing_m = 20.0;
  parameters.sensor.range_m = 20.0;
  parameters.sensor.position_sigma_m = 0.05;
  parameters.clear_the_path = true;
  return {parameters, seed};
}

double largest_m(const std::vector<geometry::SE2>& a, const std::vector<geometry::SE2>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    largest = std::max(largest, (a[i].translation() - b[i].translation()).norm());
  return largest;
}

void check_same_map(const StoredMap& a, const StoredMap& b) {
  REQUIRE(a.landmarks.size() == b.landmarks.size());
  for (std::size_t i = 0; i < a.landmarks.size(); ++i) {
    CHECK(a.landmarks[i].landmark.id == b.landmarks[i].landmark.id);
    CHECK((a.landmarks[i].landmark.position_m - b.landmarks[i].landmark.position_m).norm() < 0.05);
    CHECK(a.landmarks[i].landmark.observation_count == b.landmarks[i].landmark.observation_count);
  }
  REQUIRE(a.keyframes.size() == b.keyframes.size());
  for (std::size_t i = 0; i < a.keyframes.size(); ++i)
    CHECK((a.keyframes[i].map_T_vehicle.translation() - b.keyframes[i].map_T_vehicle.translation())
              .norm() < 0.05);
}

}  // namespace

TEST_CASE("a drive with a store is the drive without, and its file has all of it",
          "[submap_store]") {
  const sim::Drive drive = two_lanes(21);
  const TemporaryDirectory all_folder;
  Vehicle all(0.0, all_folder.path());
  all.drive(drive, 0, drive.size());
  all.finish();
  CHECK(all.stored == 0);

  const TemporaryDirectory folder;
  Vehicle bounded(120.0, folder.path());
  bounded.drive(drive, 0, drive.size());
  bounded.finish();
  CHECK(bounded.stored > 5);
  CHECK(bounded.replies > 5);
  REQUIRE(bounded.poses.size() == all.poses.size());
  CHECK(largest_m(bounded.poses, all.poses) < 0.02);

  const MapFile expected(all_folder.path() / "maps" / "drive-0001.gpkg", Access::kRead);
  const MapFile found(folder.path() / "maps" / "drive-0001.gpkg", Access::kRead);
  for (const MapFile* file : {&expected, &found}) {
    const auto findings = file->check();
    CAPTURE(findings);
    CHECK(findings.empty());
    CHECK(file->history().size() == 1);
  }
  check_same_map(found.read(1), expected.read(1));
  CHECK(found.maps()[0].submap_borders > 5);
}

TEST_CASE("a store that starts late in a drive has all of it in the end", "[submap_store]") {
  const sim::Drive drive = two_lanes(22);
  const TemporaryDirectory whole_folder;
  Vehicle whole(120.0, whole_folder.path());
  whole.drive(drive, 0, drive.size());
  whole.finish();

  // Without a store the mapper goes on, and hands over what waited when one comes.
  const TemporaryDirectory folder;
  Vehicle late(120.0, "");
  late.drive(drive, 0, drive.size() / 2);
  CHECK(late.stored == 0);
  late.start_store(folder.path());
  late.drive(drive, drive.size() / 2, drive.size());
  late.finish();
  CHECK(late.stored > 5);
  REQUIRE(late.poses.size() == whole.poses.size());
  CHECK(largest_m(late.poses, whole.poses) < 0.02);

  const MapFile found(folder.path() / "maps" / "drive-0001.gpkg", Access::kRead);
  CHECK(found.check().empty());
  check_same_map(found.read(1),
                 MapFile(whole_folder.path() / "maps" / "drive-0001.gpkg", Access::kRead).read(1));
}

TEST_CASE("what a drive takes on the disk", "[.long]") {
  constexpr double kLength_m = 5000.0;
  const sim::Drive drive = long_lanes(kLength_m, 23);
  const TemporaryDirectory folder;
  Vehicle vehicle(120.0, folder.path());
  vehicle.drive(drive, 0, drive.size());
  vehicle.finish();

  const auto path = folder.path() / "maps" / "drive-0001.gpkg";
  const RawFile raw(path);
  const auto sum = [&](const std::string& column, const std::string& table) {
    return std::stod(raw.rows(fmt::format("SELECT total(length({})) FROM {}", column, table)));
  };
  // A landmark of a submap is in the layer, and its own there; of every map that the drive began.
  std::size_t in_submaps = 0;
  std::size_t owned = 0;
  std::size_t landmarks = 0;
  std::size_t keyframes = 0;
  std::size_t submaps = 0;
  for (const auto& map : MapFile(path, Access::kRead).maps()) {
    landmarks += map.trunks + map.corners;
    keyframes += map.keyframes;
    submaps += map.submap_borders;
    const StoredMap stored = MapFile(path, Access::kRead).read(map.map_id);
    owned += static_cast<std::size_t>(std::ranges::count_if(
        stored.landmarks, [](const auto& one) { return one.submap_id.has_value(); }));
    const map_file::DriveFile file(path);
    for (model::SubmapId id = 1; id < 1000; ++id)
      if (const auto submap = file.get({map.map_id, id})) in_submaps += submap->landmarks.size();
  }
  CHECK(in_submaps >= owned);
  CHECK(owned > 200);
  const double km = 1e-3 * kLength_m;
  const double localisation = sum("landmarks", "understory_submaps") / km;
  const double file_bytes = static_cast<double>(std::filesystem::file_size(path)) / km;
  WARN(fmt::format(
      "per km: {:.0f} kB in all; of it submaps' landmarks {:.1f} kB, keyframes {:.1f} kB, payload "
      "{:.1f} kB, history {:.1f} kB; {:.0f} landmarks, {:.0f} keyframes, {:.1f} submaps",
      1e-3 * file_bytes, 1e-3 * localisation, 1e-3 * sum("keyframes", "understory_submaps") / km,
      1e-3 * sum("payload", "understory_submaps") / km,
      1e-3 * sum("changeset", "understory_history") / km, static_cast<double>(landmarks) / km,
      static_cast<double>(keyframes) / km, static_cast<double>(submaps) / km));
  CHECK(file_bytes < 2e6);
  CHECK(localisation < 30e3);
}
