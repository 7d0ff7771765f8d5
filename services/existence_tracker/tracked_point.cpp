#include "services/existence_tracker/tracked_point.hpp"

#include <bit>
#include <cstdint>
#include <cstring>
#include <stdexcept>

namespace understory::existence_tracker {
namespace {

using Saved = existence::SavedPoint<existence::IcosahedralShell>;

static_assert(std::endian::native == std::endian::little, "states are stored little endian");

/// Numbers one after the other, without the gaps that a struct has between its members.
class Packer {
 public:
  template <class T>
  void operator()(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class Unpacker {
 public:
  explicit Unpacker(std::string_view bytes) : bytes_(bytes) {}
  template <class T>
  void operator()(T& value) {
    if (bytes_.size() < sizeof(T)) throw std::invalid_argument("state of an existence is cut off");
    std::memcpy(&value, bytes_.data(), sizeof(T));
    bytes_.remove_prefix(sizeof(T));
  }
  void end() const {
    if (!bytes_.empty()) throw std::invalid_argument("state of an existence is too long");
  }

 private:
  std::string_view bytes_;
};

template <class Pack, class S>
void go_through(Pack& pack, S& saved) {
  pack(saved.version);
  pack(saved.shell_kind);
  pack(saved.odds);
  pack(saved.pass);
  pack(saved.numbers);
  pack(saved.shell);
}

template <class Pack, class S>
void go_through_model(Pack& pack, S& saved) {
  pack(saved.version);
  pack(saved.pass);
  pack(saved.recall);
  pack(saved.births);
  pack(saved.decay);
}

}  // namespace

std::size_t point_bytes() {
  constexpr Saved kSaved{};
  return sizeof(kSaved.version) + sizeof(kSaved.shell_kind) + sizeof(kSaved.odds) +
         sizeof(kSaved.pass) + sizeof(kSaved.numbers) + sizeof(kSaved.shell) + sizeof(model::Utime);
}

std::string encode(const Point& point, model::Utime looked_utime) {
  Packer pack;
  const Saved saved = point.save();
  go_through(pack, saved);
  pack(looked_utime);
  return pack.take();
}

TrackedPoint decode(const existence::ExistenceModel& model, std::string_view bytes,
                    bool is_in_use) {
  Unpacker unpack(bytes);
  Saved saved;
  go_through(unpack, saved);
  model::Utime looked_utime = 0;
  unpack(looked_utime);
  unpack.end();
  return {Point::load(model, saved), looked_utime, is_in_use, -1.0, true, false};
}

std::string encode(const existence::ExistenceModel& model) {
  Packer pack;
  const existence::SavedModel saved = model.save();
  go_through_model(pack, saved);
  return pack.take();
}

void decode(std::string_view bytes, existence::ExistenceModel& model) {
  Unpacker unpack(bytes);
  existence::SavedModel saved;
  go_through_model(unpack, saved);
  unpack.end();
  model.load(saved);
}

}  // namespace understory::existence_tracker
