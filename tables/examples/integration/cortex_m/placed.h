/* What RCSC_CONFIG names: where the tables of constants go. */
#define RCSC_CONST_SECTION __attribute__((section(".tables")))
