#include "services/existence_tracker/tracked_point.hpp"

#include <stdexcept>

#include "common/state/archive.hpp"

namespace understory::existence_tracker {
namespace {

using Saved = existence::SavedPoint<existence::IcosahedralShell>;

/// Throws if bytes are left over.
void end(const state::Reader& read) {
  if (!read.is_at_end()) throw std::invalid_argument("state of an existence is too long");
}

template <class Archive, class S>
void archive_point(Archive& a, S& saved) {
  a(saved.version, saved.shell_kind, saved.odds, saved.pass, saved.numbers, saved.shell);
}

/// Models of version 1 end before the estimates from all histories.
template <class Archive, class S>
void archive_model(Archive& a, S& saved) {
  a(saved.version, saved.pass, saved.recall, saved.births, saved.decay);
  if (saved.version > 1) a(saved.learned);
}

}  // namespace

std::size_t point_bytes() {
  constexpr Saved kSaved{};
  return sizeof(kSaved.version) + sizeof(kSaved.shell_kind) + sizeof(kSaved.odds) +
         sizeof(kSaved.pass) + sizeof(kSaved.numbers) + sizeof(kSaved.shell) +
         sizeof(model::Utime) + sizeof(std::uint8_t) + sizeof(double);
}

std::string encode(const TrackedPoint& tracked) {
  state::Writer write;
  const Saved saved = tracked.point.save();
  archive_point(write, saved);
  write(tracked.looked_utime);
  write(static_cast<std::uint8_t>(tracked.is_confirmed ? 1 : 0));
  write(tracked.judged_by);
  return write.take();
}

TrackedPoint decode(const existence::ExistenceModel& model, std::string_view bytes,
                    bool is_in_use) {
  state::Reader read(bytes);
  Saved saved;
  archive_point(read, saved);
  model::Utime looked_utime = 0;
  read(looked_utime);
  // States of older maps end here: their landmarks were confirmed or left use.
  std::uint8_t is_confirmed = 1;
  if (!read.is_at_end()) read(is_confirmed);
  // Or here: P is based on the map's estimate.
  double judged_by = model.learned().before;
  if (!read.is_at_end()) read(judged_by);
  end(read);
  if (!(judged_by >= 0.0 && judged_by < 1.0))
    throw std::invalid_argument("state of an existence: a recall that cannot be");
  return {.point = Point::load(model, saved),
          .looked_utime = looked_utime,
          .is_in_use = is_in_use,
          .state_is_due = false,
          .is_confirmed = is_confirmed != 0,
          .judged_by = judged_by};
}

std::string encode(const existence::ExistenceModel& model, const BirthCounts& births) {
  state::Writer write;
  const existence::SavedModel saved = model.save();
  archive_model(write, saved);
  write(births.confirmed);
  write(births.false_ones);
  return write.take();
}

void decode(std::string_view bytes, existence::ExistenceModel& model, BirthCounts& births) {
  state::Reader read(bytes);
  existence::SavedModel saved;
  archive_model(read, saved);
  // Likewise.
  BirthCounts counts;
  if (!read.is_at_end()) {
    read(counts.confirmed);
    read(counts.false_ones);
  }
  end(read);
  if (!(counts.confirmed >= 0.0 && counts.confirmed < 1e15 && counts.false_ones >= 0.0 &&
        counts.false_ones < 1e15))
    throw std::invalid_argument("existence: numbers of births that cannot be");
  model.load(saved);
  births = counts;
}

}  // namespace understory::existence_tracker
