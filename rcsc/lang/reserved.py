"""Words that languages, their libraries and their tools keep for themselves, one table for each scope of generated code.

In: nothing. Out: sets of words. They are written out, not asked of the interpreter or the compiler at hand: the same tables give
the same bytes everywhere. A test holds them against the headers, the interpreter and the library that are here.
"""

C_KEYWORDS = frozenset(
    """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t char32_t char8_t class co_await
    co_return co_yield compl complex concept const const_cast consteval constexpr constinit continue contract_assert decltype
    default delete do double dynamic_cast else enum explicit export extern false float for fortran friend goto if imaginary
    inline int long main mutable namespace new noexcept noreturn not not_eq nullptr operator or or_eq private protected public
    register reinterpret_cast requires restrict return short signed sizeof static static_assert static_cast struct switch
    template this thread_local throw true try typedef typeid typename typeof typeof_unqual union unsigned using virtual void
    volatile wchar_t while xor xor_eq
    """.split()
)
"""Keywords of C99 to C23 and of C++, and `main`. Words that begin with `_` are reserved by their form (ISO C99, 7.1.3)."""

C_MACROS = frozenset(
    """
    I NULL P_tmpdir arm basename cdecl d_fileno errno far fd_set h_addr h_errno huge i386 ifa_broadaddr ifa_dstaddr ifc_buf
    ifc_req ifr_addr ifr_bandwidth ifr_broadaddr ifr_data ifr_dstaddr ifr_flags ifr_hwaddr ifr_ifindex ifr_map ifr_metric
    ifr_mtu ifr_name ifr_netmask ifr_newname ifr_qlen ifr_slave interface interrupt linux math_errhandling mips msg_cbytes near
    pascal physadr quad s6_addr s6_addr16 s6_addr32 sa_handler sa_sigaction sched_priority si_addr si_addr_lsb si_arch si_band
    si_call_addr si_fd si_int si_lower si_overrun si_pid si_pkey si_ptr si_status si_stime si_syscall si_timerid si_uid si_upper
    si_utime si_value sigev_notify_attributes sigev_notify_function signgam small st_atime st_ctime st_mtime stderr stdin stdout
    strtodf sun tzname unix
    """.split()
)
"""Macros without parameters, in lower case, of ISO C, POSIX, glibc, newlib, and of compilers."""

C_FAMILIES = frozenset(
    """
    ADJ AF AI AIO AT ATOMIC BC BUFSIZ BUS CHAR CHARCLASS CLOCK CLOCKS CLONE CLOSE COLL CPU D DBL DECIMAL DL DLFO E EAI EOF ERA
    EXIT EXPR F FALLOC FE FILENAME FLT FNM FOPEN FP FTW GLOB GROUP HAVE HOST HUGE IN IN6 IN6ADDR INADDR INT IP IPV6 L LC LDBL
    LLONG LM LOGIN LONG M MADV MAP MATH MAX MB MCAST MFD MON MQ MSG N NI NL NSS NULL O ONCE P PF PKEY POSIX PRI PTHREAD PTRDIFF
    R RAND RE RLIM RTLD RWF RWH S SA SCHAR SCHED SCM SCN SEEK SEM SHM SHRT SIG SIGEV SIZE SO SPLICE STATX STDERR STDIN STDOUT
    SYNC T TCP TCPI TCPOLEN TCPOPT TEMP TIME TIMESPEC TIMEVAL TMP TSS TTY UCHAR UINT ULLONG ULONG USHRT W WCHAR WINT X XATTR
    """.split()
)
"""Prefixes of macros of ISO C, POSIX and glibc; a name that ends in `_` is none of theirs."""

C_COMPOSED = frozenset(
    """
    action_fn_t active_reg_t aio_init atomic_char16_t atomic_char32_t atomic_init atomic_int_fast16_t atomic_int_fast32_t
    atomic_int_fast64_t atomic_int_fast8_t atomic_int_least16_t atomic_int_least32_t atomic_int_least64_t atomic_int_least8_t
    atomic_intmax_t atomic_intptr_t atomic_ptrdiff_t atomic_size_t atomic_uint_fast16_t atomic_uint_fast32_t
    atomic_uint_fast64_t atomic_uint_fast8_t atomic_uint_least16_t atomic_uint_least32_t atomic_uint_least64_t
    atomic_uint_least8_t atomic_uintmax_t atomic_uintptr_t atomic_wchar_t blkcnt64_t blkcnt_t blksize_t c_line caddr_t cc_t
    char16_t char32_t char8_t clock_t clockid_t cnd_init cnd_t compar_d_fn_t compar_fn_t comparison_fn_t cookie_close_function_t
    cookie_io_functions_t cookie_read_function_t cookie_seek_function_t cookie_write_function_t cpu_set_t daddr_t dev_t div_t
    double_t error_t femode_t fenv_t fexcept_t float_t flock_t fpos64_t fpos_t fpregset_t free_fn_t fsblkcnt64_t fsblkcnt_t
    fsfilcnt64_t fsfilcnt_t fsid_t fsword_t ftw64_func_t ftw_func_t gid_t glob64_t glob_t greg_t gregset_t gwchar_t iconv_t id_t
    idtype_t imaxdiv_t in_addr_t in_port_t inet6_opt_init inet6_option_init inet6_rth_init ino64_t ino_t int16_t int32_t int64_t
    int8_t int_fast16_t int_fast32_t int_fast64_t int_fast8_t int_least16_t int_least32_t int_least64_t int_least8_t intmax_t
    intptr_t ipc_pid_t itimer_which_t key_t ldiv_t lldiv_t locale_t loff_t max_align_t mbstate_t mcontext_t mode_t mqd_t
    msglen_t msgqnum_t mtx_init mtx_t nfds_t nftw64_func_t nftw_func_t nlink_t off64_t off_t pid_t poll_t
    posix_spawn_file_actions_init posix_spawn_file_actions_t posix_spawnattr_init posix_spawnattr_t priority_which_t
    pthread_attr_init pthread_attr_t pthread_barrier_init pthread_barrier_t pthread_barrierattr_init pthread_barrierattr_t
    pthread_cond_init pthread_cond_t pthread_condattr_init pthread_condattr_t pthread_key_t pthread_list_t pthread_mutex_init
    pthread_mutex_t pthread_mutexattr_init pthread_mutexattr_t pthread_once_t pthread_rwlock_arch_t pthread_rwlock_init
    pthread_rwlock_t pthread_rwlockattr_init pthread_rwlockattr_t pthread_slist_t pthread_spin_init pthread_spinlock_t pthread_t
    pthread_unwind_buf_t ptrdiff_t quad_t re_dfa_t re_long_size_t re_size_t reg_errcode_t reg_syntax_t regex_t register_t
    regmatch_t regoff_t rlim64_t rlim_t rlimit_resource_t rusage_who_t sa_family_t sbintime_t sem_init sem_t shmatt_t
    sig_atomic_t sig_t sigevent_t sighandler_t siginfo_t sigset_t sigval_t size_t socklen_t speed_t ssize_t stack_t
    suseconds64_t suseconds_t tcflag_t thrd_start_t thrd_t time_t timer_t tss_dtor_t tss_t u_int16_t u_int32_t u_int64_t
    u_int8_t u_quad_t u_register_t ucontext_t uid_t uint16_t uint32_t uint64_t uint8_t uint_fast16_t uint_fast32_t uint_fast64_t
    uint_fast8_t uint_least16_t uint_least32_t uint_least64_t uint_least8_t uintmax_t uintptr_t useconds_t ut_line wchar_t
    wctrans_t wctype_t wint_t wordexp_t
    """.split()
)
"""Names of the same libraries that have the form of a generated name: a type, a function of one object."""

C_HEADERS = frozenset(
    """
    aio alloca assert byteswap complex cpio ctype dirent dlfcn elf endian errno execinfo fcntl fenv float fmtmsg fnmatch fts ftw
    getopt glob grp iconv inttypes iso646 langinfo libgen libintl limits link locale malloc math mntent monetary mqueue ndbm
    netdb nl_types obstack paths poll pthread pty pwd regex resolv sched search semaphore setjmp shadow signal spawn stdalign
    stdarg stdatomic stdbool stddef stdint stdio stdlib stdnoreturn string strings stropts sysexits syslog tar termios tgmath
    threads time trace uchar ucontext ulimit unistd utime utmpx values wchar wctype wordexp
    """.split()
)
"""Headers without a folder, of ISO C, POSIX and glibc: a file of this name would be found in their place."""

C_LIBRARIES = frozenset(
    """
    anl asan c crypt dl gcc m nsl pthread resolv rt stdc tsan ubsan util
    """.split()
)
"""Libraries that a linker finds by `-l` on its own."""

CMAKE_TARGETS = frozenset(
    """
    all all_build clean depend edit_cache help install list_install_components package package_source preinstall rebuild_cache
    run_tests test zero_check
    """.split()
)
"""Targets that CMake makes."""

PYTHON_KEYWORDS = frozenset(
    """
    False None True and as assert async await break case class continue def del elif else except finally for from global if
    import in is lambda match nonlocal not or pass raise return try type while with yield
    """.split()
)
"""Keywords of Python, soft ones too."""

PYTHON_BUILTINS = frozenset(
    """
    ArithmeticError AssertionError AttributeError BaseException BaseExceptionGroup BlockingIOError BrokenPipeError BufferError
    BytesWarning ChildProcessError ConnectionAbortedError ConnectionError ConnectionRefusedError ConnectionResetError
    DeprecationWarning EOFError Ellipsis EncodingWarning EnvironmentError Exception ExceptionGroup False FileExistsError
    FileNotFoundError FloatingPointError FutureWarning GeneratorExit IOError ImportError ImportWarning IndentationError
    IndexError InterruptedError IsADirectoryError KeyError KeyboardInterrupt LookupError MemoryError ModuleNotFoundError
    NameError None NotADirectoryError NotImplemented NotImplementedError OSError OverflowError PendingDeprecationWarning
    PermissionError ProcessLookupError PythonFinalizationError RecursionError ReferenceError ResourceWarning RuntimeError
    RuntimeWarning StopAsyncIteration StopIteration SyntaxError SyntaxWarning SystemError SystemExit TabError TimeoutError True
    TypeError UnboundLocalError UnicodeDecodeError UnicodeEncodeError UnicodeError UnicodeTranslateError UnicodeWarning
    UserWarning ValueError Warning ZeroDivisionError abs aiter all anext any ascii bin bool breakpoint bytearray bytes callable
    chr classmethod compile complex copyright credits delattr dict dir divmod enumerate eval exec exit filter float format
    frozenset getattr globals hasattr hash help hex id input int isinstance issubclass iter len license list locals map max
    memoryview min next object oct open ord pow print property quit range repr reversed round set setattr slice sorted
    staticmethod str sum super tuple type vars zip
    """.split()
)
"""Built-in names of Python up to 3.14."""

PYTHON_MODULES = frozenset(
    """
    abc aifc annotationlib antigravity argparse array ast asynchat asyncio asyncore atexit audioop base64 bdb binascii bisect
    builtins bz2 cProfile calendar cgi cgitb chunk cmath cmd code codecs codeop collections colorsys compileall compression
    concurrent configparser contextlib contextvars copy copyreg crypt csv ctypes curses dataclasses datetime dbm decimal difflib
    dis distutils doctest email encodings ensurepip enum errno faulthandler fcntl filecmp fileinput fnmatch fractions ftplib
    functools gc genericpath getopt getpass gettext glob graphlib grp gzip hashlib heapq hmac html http idlelib imaplib imghdr
    imp importlib inspect io ipaddress itertools json keyword lib2to3 linecache locale logging lzma mailbox mailcap marshal math
    mimetypes mmap modulefinder msilib msvcrt multiprocessing netrc nis nntplib nt ntpath nturl2path numbers opcode operator
    optparse os ossaudiodev pathlib pdb pickle pickletools pipes pkgutil platform plistlib poplib posix posixpath pprint profile
    pstats pty pwd py_compile pyclbr pydoc pydoc_data pyexpat queue quopri random re readline reprlib resource rlcompleter runpy
    sched secrets select selectors shelve shlex shutil signal site smtpd smtplib sndhdr socket socketserver spwd sqlite3
    sre_compile sre_constants sre_parse ssl stat statistics string stringprep struct subprocess sunau symtable sys sysconfig
    syslog tabnanny tarfile telnetlib tempfile termios textwrap this threading time timeit tkinter token tokenize tomllib trace
    traceback tracemalloc tty turtle turtledemo types typing unicodedata unittest urllib uu uuid venv warnings wave weakref
    webbrowser winreg winsound wsgiref xdrlib xml xmlrpc zipapp zipfile zipimport zlib zoneinfo
    """.split()
)
"""Modules of Python's standard library, up to 3.14: a file of this name would be found in their place."""

PYTHON_MEMBERS = frozenset(
    """
    as_integer_ratio bit_count bit_length conjugate denominator from_bytes imag mro name names numerator real to_bytes value
    values
    """.split()
)
"""Names that a member of an `IntEnum` may not have."""
