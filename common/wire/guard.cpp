#include "common/wire/guard.hpp"

#include <array>
#include <limits>
#include <stdexcept>

namespace understory::wire {
namespace {

/// LCM's own lengths are signed 32-bit numbers; larger messages cannot be decoded.
constexpr std::size_t kMostBytes = std::numeric_limits<std::int32_t>::max();

std::size_t size_of(FieldKind kind) {
  switch (kind) {
    case FieldKind::kInt16:
      return 2;
    case FieldKind::kInt32:
    case FieldKind::kFloat:
      return 4;
    case FieldKind::kInt64:
    case FieldKind::kDouble:
      return 8;
    default:
      return 1;
  }
}

/// Big-endian two's complement of 1, 2, 4 or 8 bytes.
std::int64_t integer(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = (bytes.front() & 0x80U) != 0 ? ~std::uint64_t{0} : 0;
  for (const std::uint8_t byte : bytes) value = (value << 8U) | byte;
  return static_cast<std::int64_t>(value);
}

bool is_finite_float(const std::uint8_t* at) {
  return (at[0] & 0x7FU) != 0x7FU || (at[1] & 0x80U) == 0;
}
bool is_finite_double(const std::uint8_t* at) {
  return (at[0] & 0x7FU) != 0x7FU || (at[1] & 0xF0U) != 0xF0U;
}

/// Microseconds up to the year 2255: exact in a double, as JSON and TUM files require.
constexpr std::int64_t kLatestUtime = std::int64_t{1} << 53U;

std::optional<Refusal> check_header(const MessageHeader& header) {
  if (header.utime < 0 || header.utime > kLatestUtime) {
    return Refusal{Reason::kOutOfRange, "utime: " + std::to_string(header.utime)};
  }
  if (header.sequence < 0) {
    return Refusal{Reason::kOutOfRange, "seq: " + std::to_string(header.sequence)};
  }
  return std::nullopt;
}

/// Checks bytes against layouts; its depth is that of the types, which is fixed.
class Walker {
 public:
  explicit Walker(std::span<const std::uint8_t> bytes) : left_(bytes) {}

  bool walk(const Layout& layout) {
    std::array<std::int64_t, kMostCounts> counts{};
    for (const Field& field : layout.fields) {
      std::size_t elements = field.fixed;
      if (field.counted_by >= 0) {
        const std::int64_t count = counts[static_cast<std::size_t>(field.counted_by)];
        if (!count_is_possible(count, field)) return refused_in(field.name);
        elements *= static_cast<std::size_t>(count);
      }

      if (field.counts >= 0) {
        const std::size_t size = size_of(field.kind);
        if (left_.size() < size) {
          refuse(Reason::kTooShort, "ends here");
          return refused_in(field.name);
        }
        counts[static_cast<std::size_t>(field.counts)] = integer(left_.first(size));
      }

      if (!walk_elements(field, elements)) return refused_in(field.name);
    }

    return true;
  }

  std::size_t left() const { return left_.size(); }
  Refusal refusal() && { return {reason_, path_ + ": " + text_}; }

 private:
  bool count_is_possible(std::int64_t count, const Field& field) {
    const std::size_t element =
        field.fixed *
        (field.kind == FieldKind::kStruct ? field.part->min_bytes : size_of(field.kind));
    if (count < 0) return refuse(Reason::kBadCount, "count " + std::to_string(count));
    if (static_cast<std::uint64_t>(count) > left_.size() / element) {
      return refuse(Reason::kBadCount, "count " + std::to_string(count) + ", but only " +
                                           std::to_string(left_.size()) + " bytes are left");
    }
    return true;
  }

  bool walk_elements(const Field& field, std::size_t elements) {
    if (field.kind == FieldKind::kStruct) {
      for (std::size_t i = 0; i < elements; ++i) {
        if (!walk(*field.part)) return refused_at(i, elements);
      }
      return true;
    }

    if (field.kind == FieldKind::kString) return walk_string();
    const std::size_t size = size_of(field.kind);
    if (left_.size() / size < elements) return refuse(Reason::kTooShort, "ends here");

    for (std::size_t i = 0; i < elements; ++i) {
      if (!value_is_fine(field.kind, left_.data() + i * size)) return refused_at(i, elements);
    }

    left_ = left_.subspan(elements * size);
    return true;
  }

  bool value_is_fine(FieldKind kind, const std::uint8_t* at) {
    if (kind == FieldKind::kDouble && !is_finite_double(at)) {
      return refuse(Reason::kNotFinite, "is not finite");
    }
    if (kind == FieldKind::kFloat && !is_finite_float(at)) {
      return refuse(Reason::kNotFinite, "is not finite");
    }
    if (kind == FieldKind::kBoolean && *at > 1) {
      return refuse(Reason::kOutOfRange, "neither true nor false");
    }
    return true;
  }

  bool walk_string() {
    if (left_.size() < 4) return refuse(Reason::kTooShort, "ends here");
    const std::int64_t length = integer(left_.first(4));
    left_ = left_.subspan(4);
    if (length < 1) return refuse(Reason::kBadString, "length " + std::to_string(length));

    if (static_cast<std::uint64_t>(length) > left_.size()) {
      return refuse(Reason::kBadString, "length " + std::to_string(length) + ", but only " +
                                            std::to_string(left_.size()) + " bytes are left");
    }

    const auto text = left_.first(static_cast<std::size_t>(length));
    for (std::size_t i = 0; i < text.size(); ++i) {
      const bool is_last = i + 1 == text.size();
      if ((text[i] == 0) != is_last)
        return refuse(Reason::kBadString, "does not end at its stated length");
    }

    left_ = left_.subspan(text.size());
    return true;
  }

  bool refuse(Reason reason, std::string text) {
    reason_ = reason;
    text_ = std::move(text);
    return false;
  }
  /// The path is built from the inside out, only on refusal.
  bool refused_in(std::string_view field) {
    prepend(std::string(field));
    return false;
  }
  bool refused_at(std::size_t index, std::size_t elements) {
    if (elements == 1) return false;
    std::string place(1, '[');
    place.append(std::to_string(index)).push_back(']');
    prepend(std::move(place));
    return false;
  }
  void prepend(std::string part) {
    if (!path_.empty() && path_.front() != '[') part.push_back('.');
    path_ = part.append(path_);
  }

  std::span<const std::uint8_t> left_;
  Reason reason_ = Reason::kInconsistent;
  std::string path_;
  std::string text_;
};

}  // namespace

std::optional<std::int64_t> fingerprint_of(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 8) return std::nullopt;
  return integer(bytes.first(8));
}

std::optional<MessageHeader> header_of(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 24) return std::nullopt;
  return MessageHeader{integer(bytes.subspan(8, 8)), integer(bytes.subspan(16, 8))};
}

std::optional<Refusal> check_bytes(std::span<const std::uint8_t> bytes, const WireType& type) {
  const auto fingerprint = fingerprint_of(bytes);
  if (!fingerprint) return Refusal{Reason::kTooShort, "no fingerprint"};
  if (bytes.size() > kMostBytes) return Refusal{Reason::kTooLong, "more than 2 GiB"};

  if (*fingerprint != type.fingerprint()) {
    const WireType* other = find_wire_type(*fingerprint);
    return Refusal{Reason::kWrongType,
                   "expected " + std::string(type.layout->name) + ", got " +
                       (other != nullptr ? std::string(other->layout->name) : "an unknown type")};
  }

  Walker walker(bytes.subspan(8));
  if (!walker.walk(*type.layout)) return std::move(walker).refusal();

  if (walker.left() != 0) {
    return Refusal{Reason::kTooLong, std::to_string(walker.left()) + " bytes are left over"};
  }

  return type.is_message ? check_header(*header_of(bytes)) : std::nullopt;
}

namespace internal {

const WireType& required_wire_type(std::string_view name) {
  const WireType* type = find_wire_type(name);
  if (type == nullptr) throw std::logic_error("lcmtypes/ has no " + std::string(name));
  return *type;
}

}  // namespace internal

const WireType* find_wire_type(std::string_view name) {
  for (const WireType& type : wire_types()) {
    if (type.layout->name == name) return &type;
  }
  return nullptr;
}

const WireType* find_wire_type(std::int64_t fingerprint) {
  for (const WireType& type : wire_types()) {
    if (type.fingerprint() == fingerprint) return &type;
  }
  return nullptr;
}

}  // namespace understory::wire
