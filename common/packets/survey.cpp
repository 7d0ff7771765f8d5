#include "common/packets/survey.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "common/packets/decoder.hpp"

namespace understory::packets {
namespace {

using Payload = std::span<const std::uint8_t>;

constexpr std::size_t kMostSizes = 20;
constexpr std::size_t kShownSizes = 3;

std::optional<Recognised> recognise_velodyne(Payload bytes) {
  constexpr std::size_t kProductAt = 1205;
  if (bytes.size() == io::kVelodynePositionBytes && io::parse_velodyne_position(bytes))
    return Recognised{Kind::kPosition, "", "Velodyne position packet"};
  if (bytes.size() != io::kVelodyneDataBytes) return std::nullopt;
  // HDL-64E: blocks of the lower lasers in between; its last byte is a status that changes.
  const std::array<std::pair<std::uint8_t, const char*>, 3> products{
      {{0x22, "vlp16"}, {0x28, "vlp32c"}, {0x21, "hdl32e"}}};
  if (!io::check_velodyne_packet(bytes, io::VelodyneModel::kHdl64e))
    return Recognised{Kind::kPoints, "hdl64e", "Velodyne HDL-64E data packet"};
  for (const auto& [product, name] : products) {
    if (bytes[kProductAt] == product &&
        !io::check_velodyne_packet(bytes, io::velodyne_model(name).value()))
      return Recognised{Kind::kPoints, name, fmt::format("Velodyne {} data packet", name)};
  }
  if (io::check_velodyne_packet(bytes, io::VelodyneModel::kHdl32e)) return std::nullopt;
  return Recognised{
      Kind::kPoints, "",
      fmt::format("Velodyne data packet of another model (product {:#04x})", bytes[kProductAt])};
}

/// Several profiles have equal sizes; the metadata determine the profile.
std::optional<Recognised> recognise_ouster(Payload bytes, std::uint16_t port) {
  constexpr std::uint8_t kLidar = 1;
  if (bytes.size() == kOusterImuBytes && port == kOusterImuPort)
    return Recognised{Kind::kImu, "ouster", "Ouster IMU packet"};
  if (is_ouster_imu_block(bytes) && port == kOusterImuPort)
    return Recognised{Kind::kImu, "ouster", "Ouster IMU packet, ACCEL32_GYRO32_NMEA"};
  std::string fits;
  for (const OusterProfile& profile : ouster_profiles()) {
    const bool is_legacy = profile.pixel == OusterPixel::kLegacy;
    for (const std::size_t beams : {16U, 32U, 64U, 128U}) {
      if (bytes.size() != ouster_format(profile, beams, 16).packet) continue;
      if (!is_legacy && bytes[0] != kLidar) continue;
      fits += fmt::format("{}{} beams {}", fits.empty() ? "" : " or ", beams, profile.name);
    }
  }
  if (!fits.empty()) return Recognised{Kind::kPoints, "ouster", "Ouster lidar packet, " + fits};
  if (port == kOusterLidarPort && bytes.size() > 1000)
    return Recognised{Kind::kPoints, "ouster", "Ouster lidar packet by its port"};
  return std::nullopt;
}

/// Models with six lines and with one are indistinguishable in common packet types.
Recognised recognised_sdk1(Payload bytes) {
  constexpr std::size_t kTypeAt = 9;
  constexpr std::uint8_t kSpherical = 1;
  constexpr std::uint8_t kImu = 6;
  if (bytes[kTypeAt] == kImu) return {Kind::kImu, "avia", "Livox SDK1 IMU packet"};
  if (bytes[kTypeAt] <= kSpherical)
    return {Kind::kPoints, "mid70", "Livox SDK1 point packet, mid70"};
  return {Kind::kPoints, "avia", "Livox SDK1 point packet, avia (or horizon, mid70: --model)"};
}

std::optional<Recognised> recognise_livox(Payload bytes, std::uint16_t port) {
  if (is_livox_sdk1_packet(bytes)) return recognised_sdk1(bytes);
  constexpr std::size_t kTypeAt = 10;
  if (!is_livox_packet(bytes)) return std::nullopt;
  const LivoxPorts hap = livox_ports(LivoxModel::kHap);
  const std::string name = port == hap.points || port == hap.imu ? "hap" : "mid360";
  if (bytes[kTypeAt] == 0) return Recognised{Kind::kImu, name, "Livox SDK2 IMU packet"};
  return Recognised{Kind::kPoints, name, "Livox SDK2 point packet, " + name};
}

std::string sizes_text(const Flow& flow) {
  std::vector<std::pair<std::uint64_t, std::size_t>> by_count;
  for (const auto& [size, count] : flow.sizes) by_count.emplace_back(count, size);
  std::ranges::sort(by_count, std::ranges::greater{});
  std::string text;
  for (std::size_t i = 0; i < std::min(by_count.size(), kShownSizes); ++i)
    text += fmt::format("{}{}", i == 0 ? "" : ", ", by_count[i].second);
  if (by_count.size() > kShownSizes) text += ", ...";
  return text;
}

}  // namespace

Recognised recognise(const io::CapturedPacket& packet) {
  const Payload bytes(packet.payload);
  if (auto velodyne = recognise_velodyne(bytes)) return *velodyne;
  if (const auto hesai = recognise_hesai(bytes)) {
    const std::string name(to_string(*hesai));
    return {Kind::kPoints, name, "Hesai point packet, " + name};
  }
  if (auto livox = recognise_livox(bytes, packet.port)) return *livox;
  if (auto ouster = recognise_ouster(bytes, packet.port)) return *ouster;
  if (bytes.size() > 12 && bytes[0] == 0xEE && bytes[1] == 0xFF)
    return {Kind::kUnknown, "",
            fmt::format("Hesai packet of another model (protocol {}.{})", bytes[2], bytes[3])};
  return {Kind::kUnknown, "", "not known"};
}

Survey survey_capture(const std::filesystem::path& path, std::uint64_t most_packets) {
  io::PacketCapture capture(path);
  std::map<std::pair<std::uint32_t, std::uint16_t>, Flow> flows;
  Survey survey;
  std::optional<model::Utime> first;
  std::uint64_t packets = 0;

  while (const auto packet = capture.next()) {
    if (!first) first = packet->utime;
    survey.duration_s = 1e-6 * static_cast<double>(packet->utime - *first);
    Flow& flow = flows[{packet->sender, packet->port}];
    flow.sender = packet->sender;
    flow.port = packet->port;
    const std::size_t size = packet->payload.size();
    if (flow.sizes.contains(size) || flow.sizes.size() < kMostSizes) ++flow.sizes[size];
    if (flow.packets++ == 0 || flow.recognised.model.empty()) {
      Recognised guess = recognise(*packet);
      if (flow.packets == 1 || guess.kind != Kind::kUnknown) flow.recognised = std::move(guess);
    }
    if (++packets == most_packets) {
      survey.is_whole_file = false;
      break;
    }
  }

  for (auto& [key, flow] : flows) survey.flows.push_back(std::move(flow));
  std::ranges::stable_sort(survey.flows, std::ranges::greater{}, &Flow::packets);
  return survey;
}

std::string address_text(std::uint32_t address) {
  return fmt::format("{}.{}.{}.{}", address >> 24U, (address >> 16U) & 0xFFU,
                     (address >> 8U) & 0xFFU, address & 0xFFU);
}

std::string survey_text(const Survey& survey) {
  std::string text = fmt::format("{:<16} {:>5} {:>9}  {:<20} {}\n", "sender", "port", "packets",
                                 "bytes", "looks like");
  for (const Flow& flow : survey.flows)
    text += fmt::format("{:<16} {:>5} {:>9}  {:<20} {}\n", address_text(flow.sender), flow.port,
                        flow.packets, sizes_text(flow), flow.recognised.text);
  if (survey.flows.empty()) text += "(no UDP packets over IPv4)\n";
  return text;
}

}  // namespace understory::packets
