#include "eval/harness/input_log.hpp"

#include "common/wire/convert.hpp"
#include "understory/ground_truth_t.hpp"

namespace understory::eval::harness {

InputLog::InputLog(const std::filesystem::path& file) {
  if (file.empty()) return;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path());
  writer_.emplace(file);
}

void InputLog::add(model::Utime utime, std::string_view channel,
                   std::span<const std::uint8_t> bytes) {
  if (writer_) writer_->write(utime, channel, bytes);
}

void InputLog::add_truth(model::Utime utime, const geometry::SE2& world_T_vehicle) {
  if (!writer_) return;
  ground_truth_t truth{};
  truth.seq = truths_++;
  truth.utime = utime;
  truth.world_T_vehicle = wire::to_wire(world_T_vehicle);
  add(utime, "GROUND_TRUTH", wire::encode_message(truth));
}

void InputLog::finish() {
  if (writer_) writer_->commit();
}

}  // namespace understory::eval::harness
