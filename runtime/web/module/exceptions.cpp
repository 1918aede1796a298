// C++ exceptions in WebAssembly: the part of the C++ ABI that Debian's libc++abi for WASI, which is
// built without exceptions, does not have. One thread; no std::exception_ptr.
//
// Itanium C++ ABI, "Level II: C++ ABI"; "WebAssembly exception handling, C++", of LLVM's
// documentation. The compiler calls these functions by their names.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <new>
#include <typeinfo>

// NOLINTBEGIN(readability-identifier-naming, bugprone-reserved-identifier): the ABI's names

namespace __cxxabiv1 {

/// As libc++abi lays out its classes of types: which of them catches what.
class __shim_type_info : public std::type_info {
 public:
  virtual void noop1() const;
  virtual void noop2() const;
  virtual bool can_catch(const __shim_type_info* thrown, void*& object) const = 0;
};

}  // namespace __cxxabiv1

extern "C" {

/// What a landing pad asks for, and is told. The compiler knows its layout.
struct LandingPad {
  std::uint32_t index;
  const std::uint8_t* table;
  std::uint32_t selector;
};
thread_local LandingPad __wasm_lpad_context;

}  // extern "C"

namespace {

using __cxxabiv1::__shim_type_info;

/// In front of each object that is thrown.
struct alignas(16) Exception {
  const std::type_info* type;
  void* (*destroy)(void*);  ///< destructors return their object here
  Exception* next;          ///< caught before this one, and not done with
  void* adjusted;           ///< the object, as the class that caught it
  int handlers;             ///< that are at work on it; negative while it is thrown again
};

Exception* caught = nullptr;

constexpr std::size_t kHeaderSize = (sizeof(Exception) + 15) / 16 * 16;

void* object_of(Exception* exception) {
  return reinterpret_cast<char*>(exception) + kHeaderSize;
}
Exception* header_of(void* object) {
  return reinterpret_cast<Exception*>(static_cast<char*>(object) - kHeaderSize);
}

std::uintptr_t read_unsigned(const std::uint8_t*& at) {
  std::uintptr_t value = 0;
  for (unsigned shift = 0;; shift += 7) {
    const std::uint8_t byte = *at++;
    value |= static_cast<std::uintptr_t>(byte & 0x7FU) << shift;
    if ((byte & 0x80U) == 0) return value;
  }
}

std::intptr_t read_signed(const std::uint8_t*& at) {
  std::uintptr_t value = 0;
  unsigned shift = 0;
  std::uint8_t byte = 0;
  do {
    byte = *at++;
    value |= static_cast<std::uintptr_t>(byte & 0x7FU) << shift;
    shift += 7;
  } while ((byte & 0x80U) != 0);
  if ((byte & 0x40U) != 0 && shift < 8 * sizeof(value)) value |= ~std::uintptr_t{0} << shift;
  return static_cast<std::intptr_t>(value);
}

bool catches(const __shim_type_info* type, Exception& exception) {
  void* object = object_of(&exception);
  if (type != nullptr &&  // catch (...) has none
      !type->can_catch(static_cast<const __shim_type_info*>(exception.type), object)) {
    return false;
  }
  exception.adjusted = object;
  return true;
}

}  // namespace

extern "C" {

void* __cxa_allocate_exception(std::size_t size) noexcept {
  void* memory = std::calloc(1, kHeaderSize + size);
  if (memory == nullptr) std::terminate();
  return static_cast<char*>(memory) + kHeaderSize;
}

void __cxa_free_exception(void* object) noexcept {
  std::free(header_of(object));
}

[[noreturn]] void __cxa_throw(void* object, std::type_info* type, void* (*destroy)(void*)) {
  Exception* exception = header_of(object);
  exception->type = type;
  exception->destroy = destroy;
  __builtin_wasm_throw(0, exception);
}

/// Finds the first handler of the landing pad that takes the exception: its number, or 0 where
/// there is only something to clean up.
int _Unwind_CallPersonality(void* thrown) {
  constexpr std::uint8_t kOmitted = 0xFF;
  auto& exception = *static_cast<Exception*>(thrown);
  __wasm_lpad_context.selector = 0;
  const std::uint8_t* at = __wasm_lpad_context.table;
  if (at == nullptr) return 0;
  if (*at++ != kOmitted) read_unsigned(at);  // where landing pads begin
  const std::uint8_t* types = nullptr;       // pointers to types end here
  if (*at++ != kOmitted) {
    const std::uintptr_t offset = read_unsigned(at);
    types = at + offset;
  }
  ++at;  // how call sites are encoded: numbers of seven bits
  const std::uintptr_t call_sites_size = read_unsigned(at);
  const std::uint8_t* const actions = at + call_sites_size;
  std::uintptr_t action = 0;
  for (std::uint32_t k = 0; k <= __wasm_lpad_context.index; ++k) {
    read_unsigned(at);  // the landing pad, by its number
    action = read_unsigned(at);
  }
  if (action == 0) return 0;
  for (const std::uint8_t* entry = actions + action - 1;;) {
    const std::intptr_t number = read_signed(entry);
    if (number > 0) {
      const auto* const type = reinterpret_cast<const __shim_type_info* const*>(types)[-number];
      if (catches(type, exception)) {
        __wasm_lpad_context.selector = static_cast<std::uint32_t>(number);
        return 0;
      }
    }
    const std::uint8_t* next = entry;
    const std::intptr_t offset = read_signed(next);
    if (offset == 0) return 0;
    entry += offset;
  }
}

void* __cxa_begin_catch(void* thrown) noexcept {
  auto* const exception = static_cast<Exception*>(thrown);
  exception->handlers = std::abs(exception->handlers) + 1;
  if (caught != exception) {
    exception->next = caught;
    caught = exception;
  }
  return exception->adjusted;
}

void* __cxa_get_exception_ptr(void* thrown) noexcept {
  return static_cast<Exception*>(thrown)->adjusted;
}

void __cxa_end_catch() {
  Exception* const exception = caught;
  const bool thrown_again = exception->handlers < 0;
  exception->handlers += thrown_again ? 1 : -1;
  if (exception->handlers != 0) return;
  caught = exception->next;
  if (thrown_again) return;
  if (exception->destroy != nullptr) exception->destroy(object_of(exception));
  std::free(exception);
}

[[noreturn]] void __cxa_rethrow() {
  if (caught == nullptr) std::terminate();
  caught->handlers = -caught->handlers;
  __builtin_wasm_throw(0, caught);
}

/// Variables of the one thread last as long as the page.
int __cxa_thread_atexit(void* (* /*destroy*/)(void*), void* /*object*/, void* /*library*/) {
  return 0;
}

}  // extern "C"

// NOLINTEND(readability-identifier-naming, bugprone-reserved-identifier)

void* operator new(std::size_t size) {
  void* const memory = std::malloc(size);
  if (memory == nullptr && size > 0) throw std::bad_alloc();
  return memory;
}

void operator delete(void* memory) noexcept {
  std::free(memory);
}

void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}
