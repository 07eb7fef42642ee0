!> Up to which coefficient of friction a contact by itself has one solution in a step.
!>
!> Where a contact slides its force lam, along g - mu sigma T, changes its gap by
!> lam (Wnn - mu sigma Wnt), with the flexibility W of the step without contacts: from
!> mu = Wnn/|Wnt| on it is closed by being pushed open. Source: docs/theory.md, eq. (14l).
module emcon_friction_limit
   use emcon_constraint, only : most_slips
   use emcon_constraints, only : constraint_index, constraint_set_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_is_equilibrium
   use emcon_flexibility, only : flexibility_free, flexibility_make, flexibility_move, &
      flexibility_row, flexibility_t
   use emcon_kinds, only : wp
   use emcon_march_types, only : increment_t, march_t
   use emcon_scene, only : scene_t
   use emcon_system, only : system_t
   use emcon_text, only : note_add, to_text
   implicit none
   private
   public :: friction_limit_find, friction_limit_tell

   !> So many contacts are looked at, those that are pushed most.
   integer, parameter :: most_contacts = 16
   !> A gap changes with friction if it does so by more than this part of what its own push does.
   real(wp), parameter :: depends = sqrt(epsilon(1.0_wp))

contains

   !> A note where pairs rub for the first time with a coefficient above the limit of a contact.
   !> Not in statics, where bodies may be free without contacts.
   subroutine friction_limit_tell(march, scene, increment, error)
      type(march_t), intent(inout) :: march
      type(scene_t), intent(in) :: scene
      type(increment_t), intent(inout) :: increment
      type(error_t), allocatable, intent(out) :: error
      type(flexibility_t) :: flexibility
      real(wp) :: limit(most_contacts)
      integer :: list(most_contacts), n, worst, pair, i
      character(len=:), allocatable :: what

      if (.not. march%active%friction%is_on &
         .or. evaluation_is_equilibrium(march%motion%evaluation)) return
      call choose(march, list, n)
      if (n == 0) return
      call flexibility_make(flexibility, march%system, march%active%set, &
         march%newton%correction, error)
      if (.not. allocated(error)) call friction_limit_find(march%system, march%active%set, &
         list(:n), flexibility, limit(:n), error)
      call flexibility_free(flexibility)
      if (allocated(error)) return
      associate (id => march%active%set%id(list(:n)), law => march%active%friction%law)
         worst = maxloc(law(id)%mu/limit(:n), 1)
         if (.not. law(id(worst))%mu > limit(worst)) return
         call constraint_index(march%system, id(worst), pair, i)
         what = "the coefficient of friction " // to_text(law(id(worst))%mu)
         ! As decks have it: what is rough has none.
         if (law(id(worst))%mu >= sqrt(huge(1.0_wp))) what = "friction that is ROUGH"
         call note_add(increment%notes, what // " is above " // to_text(limit(worst), 4) &
            // ": in an increment the contact of slave node " &
            // to_text(scene%node%label(march%system%contact(pair)%contact%node(i))) &
            // " may have several solutions")
      end associate
   end subroutine friction_limit_tell

   !> What is pushed most of the pairs that rub for the first time, which they have done from here
   !> on.
   subroutine choose(march, list, n)
      type(march_t), intent(inout) :: march
      integer, intent(out) :: list(:)            !! places in the set
      integer, intent(out) :: n                  !! so many of them
      logical :: is_new(march%active%set%n)
      integer :: k, pair, i

      associate (set => march%active%set, known => march%active%friction%knows_limit, &
            law => march%active%friction%law)
         is_new = .not. known(set%id(:set%n)) .and. law(set%id(:set%n))%mu > 0.0_wp
         n = min(size(list), count(is_new))
         do k = 1, n
            list(k) = maxloc(set%lam(:set%n), 1, is_new)
            is_new(list(k)) = .false.
         end do
         do k = 1, n
            call constraint_index(march%system, set%id(list(k)), pair, i)
            known(march%system%first_constraint(pair) + 1:march%system%first_constraint(pair + 1)) &
               = .true.
         end do
      end associate
   end subroutine choose

   !> The limits of contacts that rub, each by itself with what always holds; where nothing moves
   !> without contacts there are none.
   subroutine friction_limit_find(system, set, list, flexibility, limit, error)
      type(system_t), intent(in) :: system       !! with the matrix of the step
      type(constraint_set_t), intent(in) :: set  !! of the step
      integer, intent(in) :: list(:)             !! (n) places in the set
      type(flexibility_t), intent(inout) :: flexibility   !! of the step
      real(wp), intent(out) :: limit(:)          !! (n) huge: none
      type(error_t), allocatable, intent(out) :: error
      real(wp), dimension(system%space%numbering%n_unknown) :: normal, along, row
      real(wp) :: wnt(most_slips)
      integer :: k, s

      limit = huge(limit)
      if (flexibility%is_singular) return
      associate (numbering => system%space%numbering)
         do k = 1, size(list)
            associate (item => set%item(list(k)))
               call flexibility_move(flexibility, flexibility_row(numbering, item, item%g), &
                  normal, error)
               if (allocated(error)) return
               row = flexibility_row(numbering, item, item%c)
               do s = 1, size(item%t, 3)
                  call flexibility_move(flexibility, flexibility_row(numbering, item, &
                     item%t(:, :, s)), along, error)
                  if (allocated(error)) return
                  wnt(s) = item%normal*dot_product(row, along)
               end do
               associate (wnn => dot_product(row, normal), most => norm2(wnt(:size(item%t, 3))))
                  if (wnn > 0.0_wp .and. most > depends*wnn) limit(k) = wnn/most
               end associate
            end associate
         end do
      end associate
   end subroutine friction_limit_find

end module emcon_friction_limit
