/* Writes what clang counted as a raw profile, by the layout in clang's own header; so that neither its runtime library
   nor an operating system with files at exit is needed. On a target, send `bytes` to the host by whatever there is. */
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "profile/InstrProfData.inc"

enum {
#define VALUE_PROF_KIND(Enumerator, Value, Descr) Enumerator = Value,
#include "profile/InstrProfData.inc"
};
typedef void *IntPtrT;
typedef struct {
#define INSTR_PROF_DATA(Type, LLVMType, Name, Initializer) Type Name;
#include "profile/InstrProfData.inc"
} data_t;
typedef struct {
#define INSTR_PROF_RAW_HEADER(Type, Name, Initializer) Type Name;
#include "profile/InstrProfData.inc"
} header_t;

extern const data_t __start___llvm_prf_data[], __stop___llvm_prf_data[];
extern const char __start___llvm_prf_cnts[], __stop___llvm_prf_cnts[];
extern const char __start___llvm_prf_bits[] __attribute__((weak)), __stop___llvm_prf_bits[] __attribute__((weak));
extern const char __start___llvm_prf_names[], __stop___llvm_prf_names[];
int __llvm_profile_runtime; /* the runtime library is not wanted */

#define __llvm_profile_get_magic() (INSTR_PROF_RAW_MAGIC_64)
#define __llvm_profile_get_version() INSTR_PROF_RAW_VERSION
#define __llvm_write_binary_ids(file) 0u

static FILE *to;

static void bytes(const void *from, size_t size)
{
    if (size != 0u && fwrite(from, 1u, size, to) != size) {
        (void)fputs("the profile cannot be written\n", stderr);
    }
}

static void profile(void) __attribute__((destructor));

static void profile(void)
{
    static const char zeros[8];
    const data_t *const DataBegin = __start___llvm_prf_data;
    const char *const CountersBegin = __start___llvm_prf_cnts;
    const char *const BitmapBegin = __start___llvm_prf_bits;
    const char *const NamesBegin = __start___llvm_prf_names;
    const uint64_t NumData = (uint64_t)(__stop___llvm_prf_data - DataBegin);
    const uint64_t NumCounters = (uint64_t)(__stop___llvm_prf_cnts - CountersBegin) / 8u;
    const uint64_t NumBitmapBytes = (uint64_t)(__stop___llvm_prf_bits - BitmapBegin);
    const uint64_t NamesSize = (uint64_t)(__stop___llvm_prf_names - NamesBegin);
    const uint64_t PaddingBytesBeforeCounters = 0u, PaddingBytesAfterCounters = 0u;
    const uint64_t PaddingBytesAfterBitmapBytes = (8u - NumBitmapBytes % 8u) % 8u;
    const uint64_t NumVTables = 0u, VNamesSize = 0u;
    const header_t header = {
#define INSTR_PROF_RAW_HEADER(Type, Name, Initializer) Initializer,
#include "profile/InstrProfData.inc"
    };
    to = fopen("vectors.profraw", "wb");
    if (to == NULL) {
        return;
    }
    bytes(&header, sizeof header);
    bytes(DataBegin, NumData * sizeof *DataBegin);
    bytes(CountersBegin, NumCounters * 8u);
    bytes(BitmapBegin, NumBitmapBytes);
    bytes(zeros, PaddingBytesAfterBitmapBytes);
    bytes(NamesBegin, NamesSize);
    bytes(zeros, (8u - NamesSize % 8u) % 8u);
    (void)fclose(to);
}
