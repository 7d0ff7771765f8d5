#include "services/lidar_driver/packet_sockets.hpp"

#include <fmt/format.h>

#include <utility>

namespace understory::lidar_driver {
namespace {

constexpr std::size_t kPointsPerPart = 4000;  // 10 bytes each: one message is well below 60 kB
constexpr std::size_t kMostPartsWaiting = 250;

}  // namespace

PacketSockets::PacketSockets(const NetworkParameters& network,
                             const std::vector<PortSettings>& ports) {
  for (const PortSettings& port : ports)
    sockets_.push_back(std::make_unique<UdpSocket>(network.bind_address, port.number,
                                                   network.receive_buffer_bytes));
}

std::vector<int> PacketSockets::file_descriptors() const {
  std::vector<int> files;
  for (const auto& socket : sockets_) files.push_back(socket->file_descriptor());
  return files;
}

std::uint64_t PacketSockets::overruns() const {
  std::uint64_t sum = 0;
  for (const auto& socket : sockets_) sum += socket->overruns();
  return sum;
}

std::vector<wire::Refusal> PacketSockets::new_faults() {
  std::vector<wire::Refusal> faults;
  if (overruns() > overruns_reported_) {
    overruns_reported_ = overruns();
    faults.push_back(
        {wire::Reason::kQueueFull,
         fmt::format("the kernel threw away {} packets so far: raise net.core.rmem_max",
                     overruns_reported_)});
  }

  std::uint64_t errors = 0;
  std::string last;
  for (const auto& socket : sockets_) {
    errors += socket->errors();
    if (last.empty()) last = socket->last_error();
  }
  if (errors > errors_reported_) faults.push_back({wire::Reason::kStageFailed, last});
  errors_reported_ = errors;
  return faults;
}

bool SweepOutbox::post(const model::PointSweep& sweep) {
  if (parts_.size() >= kMostPartsWaiting) return false;
  for (model::PointSweep& part : split_sweep(sweep, kPointsPerPart))
    parts_.push_back(std::move(part));
  return true;
}

void SweepOutbox::send_part() {
  if (parts_.empty()) return;
  sweeps_.publish(parts_.front());
  parts_.pop_front();
}

}  // namespace understory::lidar_driver
