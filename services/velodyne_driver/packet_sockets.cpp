#include "services/velodyne_driver/packet_sockets.hpp"

#include <fmt/format.h>

#include <utility>

namespace understory::velodyne_driver {
namespace {

constexpr std::size_t kPointsPerPart = 4000;  // 10 bytes each: one message is well below 60 kB
constexpr std::size_t kMostPartsWaiting = 250;

}  // namespace

std::vector<wire::Refusal> PacketSockets::new_faults() {
  std::vector<wire::Refusal> faults;
  if (overruns() > overruns_reported_) {
    overruns_reported_ = overruns();
    faults.push_back(
        {wire::Reason::kQueueFull,
         fmt::format("the kernel threw away {} packets so far: raise net.core.rmem_max",
                     overruns_reported_)});
  }

  const std::uint64_t errors = data_.errors() + positions_.errors();
  if (errors > errors_reported_) {
    const bool of_data = !data_.last_error().empty();
    faults.push_back(
        {wire::Reason::kStageFailed, of_data ? data_.last_error() : positions_.last_error()});
  }
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

}  // namespace understory::velodyne_driver
