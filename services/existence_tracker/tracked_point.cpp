#include "services/existence_tracker/tracked_point.hpp"

#include <stdexcept>

#include "common/state/archive.hpp"

namespace understory::existence_tracker {
namespace {

using Saved = existence::SavedPoint<existence::IcosahedralShell>;

/// Throws where bytes are left over.
void end(const state::Reader& read) {
  if (!read.is_at_end()) throw std::invalid_argument("state of an existence is too long");
}

template <class Archive, class S>
void archive_point(Archive& a, S& saved) {
  a(saved.version, saved.shell_kind, saved.odds, saved.pass, saved.numbers, saved.shell);
}

template <class Archive, class S>
void archive_model(Archive& a, S& saved) {
  a(saved.version, saved.pass, saved.recall, saved.births, saved.decay);
}

}  // namespace

std::size_t point_bytes() {
  constexpr Saved kSaved{};
  return sizeof(kSaved.version) + sizeof(kSaved.shell_kind) + sizeof(kSaved.odds) +
         sizeof(kSaved.pass) + sizeof(kSaved.numbers) + sizeof(kSaved.shell) + sizeof(model::Utime);
}

std::string encode(const Point& point, model::Utime looked_utime) {
  state::Writer write;
  const Saved saved = point.save();
  archive_point(write, saved);
  write(looked_utime);
  return write.take();
}

TrackedPoint decode(const existence::ExistenceModel& model, std::string_view bytes,
                    bool is_in_use) {
  state::Reader read(bytes);
  Saved saved;
  archive_point(read, saved);
  model::Utime looked_utime = 0;
  read(looked_utime);
  end(read);
  return {Point::load(model, saved), looked_utime, is_in_use, -1.0, true, false};
}

std::string encode(const existence::ExistenceModel& model) {
  state::Writer write;
  const existence::SavedModel saved = model.save();
  archive_model(write, saved);
  return write.take();
}

void decode(std::string_view bytes, existence::ExistenceModel& model) {
  state::Reader read(bytes);
  existence::SavedModel saved;
  archive_model(read, saved);
  end(read);
  model.load(saved);
}

}  // namespace understory::existence_tracker
