// Calls of rebounce.h in the order of the input: handles that end before those made of them, arrays
// of any size, numbers that are none, structures of older and of impossible versions. What the
// header asks of a caller is kept: a handle is not used after its end, and an array has the entries
// that the call says.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "rebounce.h"
#include "tests/fuzz/fuzz_target.h"

namespace rebounce::fuzz {
namespace {

// The input as a row of choices; zeros follow its end.
class Choices {
 public:
  explicit Choices(Bytes input) : rest_(input) {}

  bool any_left() const { return !rest_.empty(); }

  std::uint8_t byte() {
    if (rest_.empty()) return 0;
    const std::uint8_t value = rest_.front();
    rest_ = rest_.subspan(1);
    return value;
  }

  std::uint32_t below(std::uint32_t count) { return byte() % count; }

  std::uint32_t word() {
    std::uint32_t value = 0;
    for (int k = 0; k < 4; ++k) value = value << 8 | byte();
    return value;
  }

  float number() {
    constexpr std::array kNumbers{0.0F,
                                  1.0F,
                                  0.5F,
                                  -1.0F,
                                  -0.0F,
                                  1e-30F,
                                  1e30F,
                                  std::numeric_limits<float>::quiet_NaN(),
                                  std::numeric_limits<float>::infinity(),
                                  std::numeric_limits<float>::max(),
                                  std::numeric_limits<float>::denorm_min()};
    const std::uint8_t choice = byte();
    if (choice < kNumbers.size()) return kNumbers[choice];
    if (choice < 32) return std::bit_cast<float>(word());
    return static_cast<float>(choice - 128) / 32;
  }

  void numbers(float* target, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) target[k] = number();
  }

  // Mostly `right`, sometimes less or more.
  std::size_t count(std::size_t right) {
    const std::uint8_t choice = byte();
    if (choice < 160) return right;
    return choice < 208 ? right - std::min<std::size_t>(right, choice - 159) : choice - 208;
  }

  Bytes bytes(std::size_t most) {
    const Bytes taken = rest_.first(std::min(most, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }

 private:
  Bytes rest_;
};

const std::vector<char>& room() {
  static const std::vector<char> bytes = [] {
    std::ifstream stream(REBOUNCE_SOURCE_DIR "/tests/fuzz/room.safetensors", std::ios::binary);
    return std::vector<char>(std::istreambuf_iterator<char>(stream), {});
  }();
  return bytes;
}

// A structure in memory of just the size that it states, or of a page where that is larger: a size
// that no version has is refused before anything is read.
template <typename Struct>
class Stated {
 public:
  Stated(const Struct& filled, std::uint32_t size)
      : size_(std::clamp<std::size_t>(size, sizeof(size), 4096)), bytes_(new std::byte[size_]{}) {
    std::memcpy(bytes_.get(), &filled, std::min(size_, sizeof(Struct)));
    std::memcpy(bytes_.get(), &size, sizeof(size));
  }
  Struct* get() { return reinterpret_cast<Struct*>(bytes_.get()); }

 private:
  std::size_t size_;
  std::unique_ptr<std::byte[]> bytes_;
};

// Mostly that of this version.
std::uint32_t struct_size(Choices& choices, std::size_t of_this_version) {
  const std::uint8_t choice = choices.byte();
  if (choice < 192) return static_cast<std::uint32_t>(of_this_version);
  return choice < 255 ? 4 * (choice - 192U) : std::numeric_limits<std::uint32_t>::max();
}

class Session {
 public:
  explicit Session(Bytes input) : choices_(input) {}
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session() {
    for (rebounce_transfer* transfer : transfers_) rebounce_transfer_release(transfer);
    rebounce_transfer_release(whole_room_);
    for (rebounce_engine* engine : engines_) rebounce_engine_destroy(engine);
    for (rebounce_ies_profile* profile : profiles_) rebounce_ies_profile_destroy(profile);
    static volatile float kept;  // so that nothing is left out
    kept = sum_;
    static_cast<void>(kept);
  }

  void run() {
    constexpr int kMostCalls = 64;
    for (int call = 0; call < kMostCalls && choices_.any_left(); ++call) this->call();
  }

 private:
  static constexpr std::size_t kHandles = 3;

  void call() {
    using Call = void (Session::*)();
    constexpr std::array<Call, 18> kCalls{
        &Session::read_transfer, &Session::end_transfer,   &Session::make_engine,
        &Session::end_engine,    &Session::clone_engine,   &Session::relight,
        &Session::relight,       &Session::relight_direct, &Session::set_sky,
        &Session::set_emission,  &Session::read_results,   &Session::write_outputs,
        &Session::read_tables,   &Session::read_entries,   &Session::get_points,
        &Session::parse_profile, &Session::harmonics,      &Session::graphics_card};
    (this->*kCalls[choices_.below(kCalls.size())])();
    require_last_error_is_one_line();
  }

  static void require_last_error_is_one_line() {
    const std::string_view error = rebounce_last_error();
    require(error.find('\n') == std::string_view::npos, "the last error is one line");
  }

  static bool good(rebounce_status status) {
    require(status >= REBOUNCE_OK && status < REBOUNCE_INTERNAL, "no mistake of ours");
    return status == REBOUNCE_OK;
  }

  rebounce_transfer*& transfer() { return transfers_[choices_.below(kHandles)]; }
  rebounce_engine*& engine() { return engines_[choices_.below(kHandles)]; }

  // Mostly another handle of one that is there: reading takes longer than all other calls.
  void read_transfer() {
    rebounce_transfer*& handle = transfer();
    rebounce_transfer_release(handle);
    const std::uint8_t choice = choices_.byte();
    if (choice < 224) {
      if (whole_room_ == nullptr) whole_room_ = read_room(room().size());
      handle = whole_room_;
      rebounce_transfer_retain(handle);
    } else {
      handle = read_room(choice < 240 ? room().size() : choices_.word() % room().size());
    }
  }

  static rebounce_transfer* read_room(std::size_t size) {
    const std::vector<char> bytes(room().begin(),
                                  room().begin() + static_cast<std::ptrdiff_t>(size));
    rebounce_transfer* handle = nullptr;
    const rebounce_status status = rebounce_transfer_read(bytes.data(), size, "room", &handle);
    require(good(status) == (handle != nullptr), "a handle if and only if it was read");
    return handle;
  }

  void end_transfer() {
    rebounce_transfer*& handle = transfer();
    if (choices_.byte() % 4 == 0) {
      rebounce_transfer_retain(handle);
      rebounce_transfer_release(handle);
    } else {
      rebounce_transfer_release(std::exchange(handle, nullptr));
    }
  }

  void make_engine() {
    rebounce_engine*& handle = engine();
    rebounce_engine_destroy(std::exchange(handle, nullptr));
    rebounce_engine_settings settings;
    rebounce_engine_settings_init(&settings);
    // A large number is granted, and takes long.
    settings.points_per_patch = choices_.below(5);
    settings.area_light_samples = choices_.byte() < 192 ? 1 : choices_.byte() - 200U;
    settings.light_capacity = choices_.byte() < 224 ? choices_.below(8) : 64U * choices_.byte();
    Stated<rebounce_engine_settings> stated(settings, struct_size(choices_, sizeof(settings)));
    const bool has_settings = choices_.byte() < 240;
    good(rebounce_engine_create(transfer(), has_settings ? stated.get() : nullptr, &handle));
  }

  void end_engine() { rebounce_engine_destroy(std::exchange(engine(), nullptr)); }

  void clone_engine() {
    rebounce_engine* const from = engine();
    rebounce_engine*& to = engine();
    if (from == to) return;
    rebounce_engine_destroy(std::exchange(to, nullptr));
    good(rebounce_engine_clone(from, &to));
  }

  rebounce_light light() {
    rebounce_light light;
    rebounce_light_init(&light);
    light.type = choices_.byte() < 240 ? choices_.below(6) : choices_.byte();
    choices_.numbers(light.position, 3);
    if (light.type >= REBOUNCE_LIGHT_SPHERE) {
      light.radius = choices_.number();
      choices_.numbers(light.size, 2);
    }
    const std::uint8_t fields = choices_.byte();
    if (fields & 1U) choices_.numbers(light.direction, 3);
    if (fields & 2U) choices_.numbers(light.color, 3);
    if (fields & 4U) light.intensity = choices_.number();
    if (fields & 8U) light.range = choices_.number();
    if (fields & 16U) light.inner_cone_angle = choices_.number();
    if (fields & 32U) light.outer_cone_angle = choices_.number();
    if (fields & 64U) choices_.numbers(light.tangent, 3);
    if (fields & 128U) light.profile = profiles_[choices_.below(kHandles)];
    return light;
  }

  void relight() {
    const std::size_t count = choices_.below(6);
    const std::uint32_t size =
        std::min<std::uint32_t>(struct_size(choices_, sizeof(rebounce_light)), 4096);
    const std::size_t stride = std::max<std::size_t>(size, sizeof(size));
    const std::unique_ptr<std::byte[]> lights(new std::byte[count * stride]{});
    for (std::size_t k = 0; k < count; ++k) {
      const rebounce_light filled = light();
      std::memcpy(lights.get() + k * stride, &filled, std::min(stride, sizeof(filled)));
      // The first entry says how far apart all are.
      const std::uint32_t stated = k == 0 || choices_.byte() < 250 ? size : choices_.word();
      std::memcpy(lights.get() + k * stride, &stated, sizeof(stated));
    }
    rebounce_sky sky{{1, 1, 1}, 100};
    const std::uint8_t sky_choice = choices_.byte();
    if (sky_choice < 64) choices_.numbers(sky.color, 3), sky.luminance = choices_.number();
    good(rebounce_engine_relight(engine(), reinterpret_cast<const rebounce_light*>(lights.get()),
                                 count, sky_choice < 128 ? &sky : nullptr));
  }

  // Numbers in memory of exactly their size.
  std::unique_ptr<float[]> array(std::size_t count) {
    std::unique_ptr<float[]> values(new float[count]);
    for (std::size_t k = 0; k < count; ++k) values[k] = 1;
    for (int k = choices_.below(4); k > 0 && count > 0; --k) {
      values[choices_.word() % count] = choices_.number();
    }
    return values;
  }

  rebounce_transfer_info info() {
    // That of the room, which all engines here are of.
    rebounce_transfer_info info;
    rebounce_transfer_info_init(&info);
    for (rebounce_transfer* transfer : transfers_) {
      if (transfer != nullptr) good(rebounce_transfer_get_info(transfer, &info));
    }
    return info;
  }

  void relight_direct() {
    const std::size_t count = choices_.count(info().patch_count);
    const auto irradiance = array(3 * count);
    good(rebounce_engine_relight_direct(engine(), irradiance.get(), count));
  }

  void set_sky() {
    const auto distribution = array(REBOUNCE_SKY_CELL_COUNT);
    if (choices_.byte() < 64) {
      std::array<float, 3> sun{};
      choices_.numbers(sun.data(), 3);
      const int type = choices_.byte() < 224 ? static_cast<int>(choices_.below(17))
                                             : static_cast<int>(choices_.word());
      good(rebounce_cie_sky(type, sun.data(), choices_.number(), distribution.get()));
    }
    const bool uniform = choices_.byte() < 32;
    good(rebounce_engine_set_sky_distribution(engine(), uniform ? nullptr : distribution.get()));
  }

  void set_emission() {
    std::array<float, 3> scale{};
    choices_.numbers(scale.data(), 3);
    const std::uint32_t material = choices_.byte() < 224 ? choices_.below(3) : choices_.word();
    good(rebounce_engine_set_emission_scale(engine(), material, scale.data()));
  }

  void read_results() {
    const rebounce_engine* const handle = engine();
    for (const float* values :
         {rebounce_engine_direct_irradiance(handle), rebounce_engine_indirect_irradiance(handle),
          rebounce_engine_radiosity(handle)}) {
      require((values == nullptr) == (handle == nullptr), "results of every engine");
      for (std::size_t k = 0; values != nullptr && k < 3 * std::size_t{info().patch_count}; ++k) {
        sum_ += values[k];
      }
    }
  }

  void write_outputs() {
    rebounce_engine* const handle = engine();
    const rebounce_transfer_info sizes = info();
    const std::size_t texels = std::size_t{sizes.lightmap_width} * sizes.lightmap_height;
    const std::size_t normals = choices_.below(4);
    const auto bent = array(3 * normals);
    const auto write = [&](std::size_t right, std::size_t floats, const auto& call) {
      const std::size_t count = choices_.count(right);
      const auto values = array(floats * count);
      good(call(values.get(), count));
    };
    switch (choices_.below(7)) {
      case 0:
        return write(sizes.vertex_count, 3, [&](float* values, std::size_t count) {
          return rebounce_engine_vertex_irradiance(handle, values, count);
        });
      case 1:
        return write(sizes.vertex_count, 3, [&](float* values, std::size_t count) {
          return rebounce_engine_vertex_direct_irradiance(handle, values, count);
        });
      case 2:
        return write(sizes.vertex_count, 12, [&](float* values, std::size_t count) {
          return rebounce_engine_vertex_light(handle, values, count);
        });
      case 3:
        return write(texels, 3, [&](float* values, std::size_t count) {
          return rebounce_engine_lightmap_irradiance(handle, values, count);
        });
      case 4:
        return write(sizes.probe_count, 27, [&](float* values, std::size_t count) {
          return rebounce_engine_probe_light(handle, values, count);
        });
      case 5:
        return write(sizes.probe_count, 54, [&](float* values, std::size_t count) {
          return rebounce_engine_probe_light_to_degree_4(handle, values, count);
        });
      default:
        return write(sizes.probe_count, 3 * normals, [&](float* values, std::size_t count) {
          return rebounce_engine_probe_irradiance(handle, bent.get(), normals, values, count);
        });
    }
  }

  template <typename Value>
  void add_up(const Value* values, std::size_t count) {
    for (std::size_t k = 0; values != nullptr && k < count; ++k) {
      sum_ += static_cast<float>(values[k]);
    }
  }

  void read_tables() {
    const rebounce_transfer* const handle = transfer();
    const rebounce_transfer_info sizes = info();
    const std::size_t n = sizes.patch_count, v = sizes.vertex_count, t = sizes.triangle_count;
    add_up(rebounce_transfer_patch_area(handle), n);
    add_up(rebounce_transfer_patch_centroid(handle), 3 * n);
    add_up(rebounce_transfer_patch_normal(handle), 3 * n);
    add_up(rebounce_transfer_patch_reflectance(handle), 3 * n);
    add_up(rebounce_transfer_patch_role(handle), n);
    add_up(rebounce_transfer_vertex_position(handle), 3 * v);
    add_up(rebounce_transfer_vertex_normal(handle), 3 * v);
    add_up(rebounce_transfer_triangle(handle), 3 * t);
    add_up(rebounce_transfer_triangle_patch(handle), t);
    add_up(rebounce_transfer_triangle_material(handle), t);
    add_up(rebounce_transfer_lightmap_texcoord(handle), 2 * v);
    add_up(rebounce_transfer_lightmap_triangle(handle), t);
    add_up(rebounce_transfer_probe_position(handle), 3 * std::size_t{sizes.probe_count});
    add_up(rebounce_transfer_probe_valid(handle), sizes.probe_count);
    const std::uint32_t* const begin = rebounce_transfer_vertex_weight_begin(handle);
    const std::size_t weights = begin != nullptr ? begin[v] : 0;
    add_up(begin, v + 1);
    add_up(rebounce_transfer_vertex_weight_patch(handle), weights);
    add_up(rebounce_transfer_vertex_weight(handle), weights);
  }

  void read_entries() {
    const rebounce_transfer* const handle = transfer();
    const std::uint32_t index = choices_.byte() < 224 ? choices_.below(3) : choices_.word();
    const char* const name = rebounce_transfer_material_name(handle, index);
    if (name != nullptr) sum_ += static_cast<float>(std::strlen(name));
    add_up(rebounce_transfer_material_luminance(handle, index), 3);
    const char* const camera_name = rebounce_transfer_camera_name(handle, index);
    if (camera_name != nullptr) sum_ += static_cast<float>(std::strlen(camera_name));
    rebounce_camera camera;
    rebounce_camera_init(&camera);
    Stated<rebounce_camera> stated_camera(camera, struct_size(choices_, sizeof(camera)));
    good(rebounce_transfer_get_camera(handle, index, stated_camera.get()));
    rebounce_transfer_info sizes;
    rebounce_transfer_info_init(&sizes);
    Stated<rebounce_transfer_info> stated_sizes(sizes, struct_size(choices_, sizeof(sizes)));
    good(rebounce_transfer_get_info(handle, stated_sizes.get()));
  }

  void get_points() {
    const std::uint32_t per_patch = choices_.byte() < 224 ? choices_.below(4) : choices_.word();
    const std::size_t right = std::size_t{per_patch} * info().patch_count;
    const std::size_t count = choices_.count(right < 4096 ? right : 4096);
    const auto position = array(3 * count), normal = array(3 * count);
    good(rebounce_transfer_receiver_points(transfer(), per_patch, position.get(), normal.get(),
                                           count));
  }

  void parse_profile() {
    rebounce_ies_profile*& handle = profiles_[choices_.below(kHandles)];
    rebounce_ies_profile_destroy(std::exchange(handle, nullptr));
    constexpr std::string_view kBegin =
        "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0 1 1 10\n0 45 90\n0\n";
    std::string text(kBegin);
    if (choices_.byte() < 128) {
      text += "100 50 0\n";
    } else {
      for (const std::uint8_t c : choices_.bytes(16)) text += static_cast<char>(c);
    }
    good(rebounce_ies_profile_parse(text.data(), text.size(), "lamp.ies", &handle));
  }

  void harmonics() {
    const auto coefficients = array(54), normal = array(3), bent = array(3), result = array(3);
    rebounce_harmonics_irradiance(coefficients.get(), normal.get(), result.get());
    rebounce_harmonics_irradiance_to_degree_4(coefficients.get(), normal.get(), result.get());
    rebounce_bent_irradiance(coefficients.get(), result.get(), normal.get(), bent.get(),
                             result.get());
    const std::size_t size = choices_.below(9);
    const auto normals = array(3 * size * size);
    rebounce_octahedral_normals(size, normals.get());
  }

  // A context that has no function.
  void graphics_card() {
    rebounce_gpu_engine* card = nullptr;
    const auto none = [](const char*) -> rebounce_gl_function { return nullptr; };
    require(!good(rebounce_gpu_engine_create(transfer(), none, &card)) && card == nullptr,
            "there is no engine without OpenGL");
    rebounce_gpu_engine_destroy(card);
  }

  Choices choices_;
  rebounce_transfer* whole_room_ = nullptr;  ///< that the input reads first; each begins anew
  std::array<rebounce_transfer*, kHandles> transfers_{};
  std::array<rebounce_engine*, kHandles> engines_{};
  std::array<rebounce_ies_profile*, kHandles> profiles_{};
  float sum_ = 0;  ///< of all that was read
};

}  // namespace
}  // namespace rebounce::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  rebounce::fuzz::Session({data, size}).run();
  return 0;
}
