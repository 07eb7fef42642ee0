!> *ELASTIC with constants of several directions, and the *ORIENTATION that turns them.
module emcon_deck_anisotropic
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, get_real, next_line
   use emcon_deck_reader, only : card_error, card_t, n_cards, note_idle, option_name, &
      reader_t
   use emcon_diagnostics, only : quoted, suggestion
   use emcon_kinds, only : wp
   use emcon_moduli, only : moduli_of, n_moduli, n_strain
   use emcon_rotation, only : cross_product
   use emcon_text, only : string_t
   use emcon_turned_axes, only : rectangular_axes
   implicit none
   private
   public :: is_anisotropic, anisotropic_names, anisotropic_constants
   public :: read_orientation, turn_constants, note_orientations

   integer, parameter :: n_axis = 3, n_name = 6
   !> Components 11, 22, 33, 12, 23, 13 of a tensor; place of each.
   integer, parameter :: row(n_strain) = [1, 2, 3, 1, 2, 1], column(n_strain) = [1, 2, 3, 2, 3, 3]
   integer, parameter :: place_of(n_axis, n_axis) = reshape([1, 4, 6, 4, 2, 5, 6, 5, 3], &
      [n_axis, n_axis])
   !> Names of constants as decks have them: components 11, 22, 33, 12, 13, 23.
   character(len=n_name), parameter :: orthotropic(*) = [character(len=n_name) :: "D1111", &
      "D1122", "D2222", "D1133", "D2233", "D3333", "D1212", "D1313", "D2323"]
   character(len=n_name), parameter :: anisotropic(*) = [character(len=n_name) :: &
      orthotropic(:6), "D1112", "D2212", "D3312", "D1212", "D1113", "D2213", "D3313", "D1213", &
      "D1313", "D1123", "D2223", "D3323", "D1223", "D1323", "D2323"]
   character(len=n_name), parameter :: engineering(*) = [character(len=n_name) :: "E1", "E2", &
      "E3", "nu12", "nu13", "nu23", "G12", "G13", "G23"]

contains

   !> Does TYPE= of *ELASTIC name one of these?
   pure logical function is_anisotropic(card)
      type(card_t), intent(in) :: card

      is_anisotropic = size(anisotropic_names(card)) > 0 .and. card%name == "ELASTIC"
   end function is_anisotropic

   !> The constants in the order of the deck; none: it is isotropic.
   pure function anisotropic_names(card) result(names)
      type(card_t), intent(in) :: card
      character(len=n_name), allocatable :: names(:)

      select case (option_name(card, "TYPE"))
      case ("ORTHO", "ORTHOTROPIC")
         names = orthotropic
      case ("ANISO", "ANISOTROPIC")
         names = anisotropic
      case ("ENGINEERINGCONSTANTS", "ENGINEERING CONSTANTS")
         names = engineering
      case default
         allocate(names(0))
      end select
   end function anisotropic_names

   !> The constants of the law, of those of a deck.
   pure function anisotropic_constants(names, value) result(constant)
      character(len=n_name), intent(in) :: names(:)
      real(wp), intent(in) :: value(:)           !! as `names`
      real(wp) :: constant(n_moduli), c(n_strain, n_strain)
      integer :: k

      c = 0.0_wp
      if (any(names == engineering(1))) then
         c = by_engineering(value)
      else
         do k = 1, size(names)
            c = set(c, names(k), value(k))
         end do
      end if
      constant = triangle(c)
   end function anisotropic_constants

   !> C with the constant `name` in its two places.
   pure function set(c, name, value) result(new)
      real(wp), intent(in) :: c(n_strain, n_strain)
      character(len=*), intent(in) :: name       !! D1122
      real(wp), intent(in) :: value
      real(wp) :: new(n_strain, n_strain)
      integer :: a, b, i, k

      read (name, "(1x, 4i1)") i, k, a, b
      new = c
      new(place_of(i, k), place_of(a, b)) = value
      new(place_of(a, b), place_of(i, k)) = value
   end function set

   !> C by Young's moduli, Poisson's ratios and shear moduli: the inverse of the normal part.
   pure function by_engineering(value) result(c)
      real(wp), intent(in) :: value(3*n_axis)    !! E1, E2, E3, nu12, nu13, nu23, G12, G13, G23
      real(wp) :: c(n_strain, n_strain), soft(n_axis, n_axis)
      integer :: i, k, n

      c = 0.0_wp
      n = n_axis
      do i = 1, n_axis
         soft(i, i) = 1.0_wp/value(i)
         do k = i + 1, n_axis
            n = n + 1
            soft(i, k) = -value(n)/value(i)
            soft(k, i) = soft(i, k)
            c(place_of(i, k), place_of(i, k)) = value(n + n_axis)
         end do
      end do
      do i = 1, n_axis
         c(:n_axis, i) = cross_product(soft(:, 1 + modulo(i, n_axis)), &
            soft(:, 1 + modulo(i + 1, n_axis)))
      end do
      c(:n_axis, :n_axis) = c(:n_axis, :n_axis)/dot_product(soft(:, 1), c(:n_axis, 1))
   end function by_engineering

   pure function triangle(c) result(constant)
      real(wp), intent(in) :: c(n_strain, n_strain)
      real(wp) :: constant(n_moduli)
      integer :: i, k

      constant = [((c(i, k), i = 1, k), k = 1, n_strain)]
   end function triangle

   !> Constants that are along turned axes, along those of the model.
   pure function turn_constants(constant, axes) result(turned)
      real(wp), intent(in) :: constant(n_moduli)
      real(wp), intent(in) :: axes(n_axis, n_axis)           !! unit vectors by columns
      real(wp) :: turned(n_moduli), t(n_strain, n_strain)
      integer :: i, k

      do k = 1, n_strain                         ! strain along the turned axes, shears twice
         do i = 1, n_strain
            associate (a => axes(:, row(i)), b => axes(:, column(i)))
               t(i, k) = a(row(k))*b(column(k))
               if (k > n_axis) t(i, k) = 0.5_wp*(t(i, k) + a(column(k))*b(row(k)))
               if (i > n_axis) t(i, k) = 2.0_wp*t(i, k)
            end associate
         end do
      end do
      turned = triangle(matmul(transpose(t), matmul(moduli_of(constant), t)))
   end function turn_constants

   !> The axes of an *ORIENTATION; `ok`: there is one, and it is right.
   subroutine read_orientation(reader, section, axes, ok)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: section        !! that names it
      real(wp), intent(out) :: axes(n_axis, n_axis)
      logical, intent(out) :: ok
      type(string_t), allocatable :: known(:)
      type(data_t) :: data
      character(len=:), allocatable :: name, fault
      real(wp) :: point(2*n_axis)
      integer :: i, k

      ok = .false.
      name = option_name(section, "ORIENTATION")
      allocate(known(n_cards(reader, "ORIENTATION")))
      k = 0
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "ORIENTATION") cycle
         k = k + 1
         known(k)%text = option_name(reader%card(i), "NAME")
         if (known(k)%text == name) exit
      end do
      if (i > size(reader%card)) then
         call card_error(reader, section, "unknown orientation " // quoted(name) &
            // suggestion(name, known))
         return
      end if
      associate (card => reader%card(i))
         if (all(option_name(card, "SYSTEM") /= [character(len=11) :: "", "R", "RECTANGULAR"])) then
            call card_error(reader, card, "SYSTEM=" // option_name(card, "SYSTEM") // ": only " &
               // "rectangular axes turn the constants of a material; give each part of the body " &
               // "a section with axes of its own")
            return
         end if
         call data_open(data, card)
         if (.not. next_line(reader, data)) then
            call card_error(reader, card, "the line with the two points is missing: " &
               // "ax, ay, az, bx, by, bz")
            return
         end if
      end associate
      point = 0.0_wp
      call check_count(reader, data, 1, size(point), "ax, ay, az, bx, by, bz")
      do k = 1, size(point)
         if (data%ok) call get_real(reader, data, k, "coordinate", point(k))
      end do
      if (.not. data%ok) return
      call rectangular_axes(point(:n_axis), point(n_axis + 1:), axes, fault)
      ok = fault == ""
      if (.not. ok) call data_error(reader, data, fault)
      if (next_line(reader, data)) call data_error(reader, data, "a further turn about an axis " &
         // "is not in this version: give the two points of the turned axes")
   end subroutine read_orientation

   !> The orientations that no section with such constants names change nothing.
   subroutine note_orientations(reader, is_used)
      type(reader_t), intent(inout) :: reader
      logical, intent(in) :: is_used             !! some are used
      integer :: i

      if (is_used) return
      do i = 1, size(reader%card)
         if (reader%card(i)%name == "ORIENTATION") call note_idle(reader, reader%card(i)%title, &
            "materials are isotropic")
      end do
   end subroutine note_orientations

end module emcon_deck_anisotropic
