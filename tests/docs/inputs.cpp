// The recordings that docs/own-data.md walks through, made small: doc_inputs FOLDER
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>

#include "common/model/point_sweep.hpp"
#include "tests/cli/simulated_bag.hpp"
#include "tests/io/capture_file.hpp"
#include "tests/packets/made_up_sensor.hpp"

using namespace understory;
using namespace understory::test;

namespace {

/// A sweep as PCL would write it, named by its time.
void write_pcd(const std::filesystem::path& folder, const model::PointSweep& sweep) {
  std::ofstream file(folder / fmt::format("{}.pcd", sweep.utime), std::ios::binary);
  file << "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity ring t\nSIZE 4 4 4 4 2 4\n"
          "TYPE F F F F U U\nCOUNT 1 1 1 1 1 1\n"
       << fmt::format("WIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
                      sweep.points.size());
  const auto put = [&](const auto& value) {
    file.write(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (const model::SweepPoint& point : sweep.points) {
    put(point.x_m);
    put(point.y_m);
    put(point.z_m);
    put(static_cast<float>(point.intensity));
    put(point.ring);
    put(static_cast<std::uint32_t>(std::llround(1e9 * static_cast<double>(point.time_s))));
  }
}

/// Two seconds of an Ouster, and its metadata beside it.
void write_capture(const std::filesystem::path& folder) {
  constexpr std::uint32_t kLaser = 0xC0A801C9;  // 192.168.1.201
  constexpr int kSweeps = 20;
  std::mt19937_64 random(3);
  const MadeUpSensor sensor = made_up_ousters().front();
  const MadeUpRecording recording = sensor.record(kSweeps, SimulatedBag::kStart_ns / 1000, random);
  CaptureFile capture;
  for (const SentPacket& packet : recording.packets)
    capture.add(packet.sent + 200, kLaser, packet.port, packet.bytes);
  const auto put = [&](const char* name, const auto& bytes) {
    std::ofstream(folder / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  };
  put("laser.pcap", capture.bytes());
  put("laser.json", sensor.description.description);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: doc_inputs FOLDER\n");
    return 2;
  }
  constexpr double kSeconds = 20.0;
  const std::filesystem::path folder = argv[1];
  const SimulatedDrive drive = SimulatedBag::record(kSeconds, {bag::Encoding::kRos1});
  const BagForm form{BagForm::Kind::kRos1, "lz4", true, true, 700'000};
  write_bag(folder / "forest.bag", form, drive.bag.at(bag::Encoding::kRos1));

  std::filesystem::create_directories(folder / "clouds");
  model::SweepAssembler assembler;
  for (const wire::Bytes& bytes : drive.log.at("RAW_SWEEP")) {
    const auto part = wire::decode_message<model::PointSweep>(bytes);
    const auto sweep = part ? assembler.add(*part) : std::nullopt;
    if (sweep) write_pcd(folder / "clouds", *sweep);
  }
  write_capture(folder);
  return 0;
}
